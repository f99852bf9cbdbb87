"""MirrorTwin's science: twin, faults, residuals, diagnosis, report, jobs. Never imports ``app``."""
