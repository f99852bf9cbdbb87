"""MirrorTwin's user interfaces: command line, web server, pages, figures and 3D scenes."""
