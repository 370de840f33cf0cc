"""What commands find, as plain data for programs and as tables and sentences for people."""
