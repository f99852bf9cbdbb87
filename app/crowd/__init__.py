"""Many browser pages at once, without browsers: what the server is measured by."""
