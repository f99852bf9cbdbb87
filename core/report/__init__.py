"""From a diagnosis and the FMEA knowledge to a report whose every claim can be checked."""
