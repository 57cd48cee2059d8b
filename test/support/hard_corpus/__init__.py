"""The hard corpus: pairs whose answers are known without asking the product."""
