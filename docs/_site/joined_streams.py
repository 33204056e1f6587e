"""What a cell prints, joined as it was printed: pieces of a line are no lines of their own."""

from myst_nb.core import render


def joined(outputs):
    """Outputs of a cell with each stream in one piece, where it first came."""
    streams, kept = {}, []
    for output in outputs:
        if output["output_type"] == "stream":
            if output["name"] in streams:
                streams[output["name"]]["text"] += output["text"]
                continue
            streams[output["name"]] = output
        kept.append(output)
    return kept


def setup(app):
    """Called by Sphinx."""
    render.coalesce_streams = joined
    return {"parallel_read_safe": True}
