// SPDX-License-Identifier: GPL-2.0-or-later
// The program without MPI: always alone.
#include <cstdlib>
#include <string>

#include "cli/ranks/ranks.hpp"
#include "runtime/error.hpp"

namespace lobatto {

std::unique_ptr<Ranks> join_ranks() {
    for (const char* size : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"})
        if (const char* const text = std::getenv(size); text != nullptr && std::atoi(text) > 1)
            throw MachineError(
                "this program was started " + std::string(text) +
                " times by mpirun, but cannot share the work: it was built without MPI. Install libopenmpi-dev, build "
                "the target lobatto_mpi (cmake -DLOBATTO_MPI=ON), and start `mpirun lobatto-mpi sweep ...`");
    return nullptr;
}

}  // namespace lobatto
