// SPDX-License-Identifier: GPL-2.0-or-later
// Instructions a step, counted by valgrind's callgrind: a measure of speed that no other program on the machine
// disturbs.
#pragma once

namespace lobatto::bench {

// Counts for each problem and compares with bench/instructions.csv, or, with `store`, writes it. 0: nothing changed by
// more than 2 percent, or counted with another compiler than the stored; 1: something did, and it says what.
int check_instructions(bool store);

}  // namespace lobatto::bench
