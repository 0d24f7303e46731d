# SPDX-License-Identifier: Apache-2.0
# awk -f moved.awk: of the fragments of nine pictures (fragments() in common.sh), one after the other, of every one a
# line: its pixel, node, instance and triangle, in how many pictures it is, and the least and largest bits of Z.
{
    key = $1 " " $7 " " $8 " " $9
    if (!seen[key]++) least[key] = most[key] = $2
    if ($2 < least[key]) least[key] = $2
    if ($2 > most[key]) most[key] = $2
}
END { for (key in seen) print key, seen[key], least[key], most[key] }
