"""Pictures and algorithms that lessons use, and that would hide their subject."""
