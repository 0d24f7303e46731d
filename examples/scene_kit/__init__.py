# SPDX-License-Identifier: Apache-2.0
"""Tools of the example scenes: shapes, textures, a GLB writer; no other library."""
