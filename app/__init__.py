"""MirrorTwin's face: the command line, the web server, its pages, figures and 3D scenes."""
