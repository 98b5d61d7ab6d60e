// SPDX-License-Identifier: MIT
// Ranks where the program was built without MPI.
#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/ranks/ranks.h"

namespace darb {

std::string mpi_name() {
    return "";
}

std::unique_ptr<Ranks> start_ranks() {
    if (const int ranks = launched_ranks(); ranks > 1)
        throw Error("darb",
                    fmt::format("was started {} times together, but is built without MPI", ranks),
                    "Build it where MPI is installed (tools/setup.sh --with-mpi), or start it "
                    "without mpirun.");
    return std::make_unique<OneRank>();
}

}  // namespace darb
