"""What a page has done for it in a process of its own: fits, uploads that are read, figures that are drawn."""
