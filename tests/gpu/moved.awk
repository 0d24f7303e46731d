# SPDX-License-Identifier: Apache-2.0
# awk -f moved.awk: reads the fragments of nine pictures (made by fragments() in common.sh) one after the other. Prints
# a line per fragment: its pixel, node, instance and triangle, the number of pictures that contain it, and the least and
# greatest bits of its Z.
{
    key = $1 " " $7 " " $8 " " $9
    if (!seen[key]++) least[key] = most[key] = $2
    if ($2 < least[key]) least[key] = $2
    if ($2 > most[key]) most[key] = $2
}
END { for (key in seen) print key, seen[key], least[key], most[key] }
