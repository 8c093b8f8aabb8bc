// SPDX-License-Identifier: GPL-2.0-or-later
// How fast sweeps are on a device, beside one and all cores of the processor.
#pragma once

namespace lobatto::bench {

// P1 to P4, 10^3 to 10^7 trajectories. Without a device it says what was not measured, and measures nothing.
void print_device_rates();

}  // namespace lobatto::bench
