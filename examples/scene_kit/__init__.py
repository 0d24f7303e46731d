# SPDX-License-Identifier: Apache-2.0
"""What the example scenes are made with: shapes, textures, a GLB writer; no other library."""
