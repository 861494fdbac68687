"""Binary STL: 80 bytes of head, the number of facets, 50 bytes a facet, little-endian."""

import numpy as np

HEAD = 84  # bytes before the facets
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])


def binary(corners, head: str, normals=0.0) -> bytes:
    """corners (T, 3, 3); normals (T, 3). A normal of 0 says that the order of the corners gives it."""
    rows = np.zeros(len(corners), FACET)
    rows["normal"], rows["corners"] = normals, corners
    return head.encode("ascii", "replace")[:80].ljust(80) + len(rows).to_bytes(4, "little") + rows.tobytes()
