# SPDX-License-Identifier: Apache-2.0
"""The example scenes, one per file; each file has `build() -> Glb`."""
