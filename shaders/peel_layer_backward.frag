// SPDX-License-Identifier: Apache-2.0
// The same from the other end: the farthest fragment in front of the previous layer.
#define BACKWARD
#include "peel_layer.frag"
