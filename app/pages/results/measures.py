"""The measures that a table of results may hold: name, number format, word of the glossary."""

MEASURES: dict[str, tuple[str, str]] = {
    "accuracy": ("Accuracy", ".3f"),
    "macro_precision": ("Precision", ".3f"),
    "macro_recall": ("Recall", ".3f"),
    "macro_f1": ("Macro-F1", ".3f"),
    "per_class_f1_sd": ("Spread of F1 over classes", ".3f"),
    "mae": ("MAE, channel units", ".2f"),
    "rmse": ("RMSE, channel units", ".2f"),
    "mirror_ms": ("Mirror, ms", ".1f"),
    "features_ms": ("Features, ms", ".1f"),
    "cnn_ms": ("Network, ms", ".1f"),
    "total_ms": ("Total, ms", ".1f"),
    "ccc": ("Causal chain coverage", ".3f"),
    "sec": ("Sensor evidence consistency", ".3f"),
    "dc": ("Diagnostic consistency", ".3f"),
    "hr": ("Hallucination rate", ".3f"),
}
"""Name and number format of every measure that a table may hold."""

EXPLAINED: dict[str, str] = {
    "accuracy": "accuracy",
    "macro_precision": "precision",
    "macro_recall": "recall",
    "macro_f1": "macro_f1",
    "ccc": "ccc",
    "sec": "sec",
    "dc": "dc",
    "hr": "hr",
}
"""The word of the glossary that says what a measure is."""
