"""What a reader sees: blocks, written as text and as HTML."""
