// SPDX-License-Identifier: MIT
// The errors that are not the input's fault.
#pragma once

#include <stdexcept>

namespace lobatto {

// The computation failed (exit code 3): not converged, not finite, singular.
class ComputationError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// The compiler or the machine failed (exit code 4): no compiler, compiler error, full disk, unwritable folder.
class MachineError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace lobatto
