"""Small cone programs whose rows reach over a band of variables."""
