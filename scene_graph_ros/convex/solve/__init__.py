"""The wall behind which programs are solved: answers are proven, or say that they are not."""
