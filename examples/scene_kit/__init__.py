# SPDX-License-Identifier: Apache-2.0
"""Tools to make the example scenes, without other libraries: shapes, textures, a GLB writer."""
