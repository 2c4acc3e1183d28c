"""One module for each kind of synthesis."""
