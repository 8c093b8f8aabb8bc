// SPDX-License-Identifier: MIT
// Runs another program: fork and exec with an argument list, never a shell; bounded in time and output.
#pragma once

#include <atomic>
#include <string>
#include <utility>
#include <vector>

namespace lobatto {

struct ProcessRequest {
    std::vector<std::string> arguments;                            // arguments[0] is the path of the program
    std::string folder;                                            // where it runs
    std::vector<std::pair<std::string, std::string>> environment;  // set in addition to ours
    double seconds_limit = 120;
    // True, or not 0: nobody waits for it any longer, so it is ended.
    const std::atomic<bool>* abandoned = nullptr;
    const volatile int* interrupted = nullptr;
};

struct ProcessResult {
    std::string output;      // standard output and error together, at most 1 MiB of it
    int exit_code = -1;      // when it ended by itself
    int signal = 0;          // when a signal ended it
    bool timed_out = false;  // when we ended it
    bool abandoned = false;  // likewise, since nobody waited
    bool succeeded() const { return exit_code == 0; }
};

// Its standard input is empty. When it has ended, or the calling thread dies, all that runs in its process group is
// killed. Throws MachineError when it cannot be started.
ProcessResult run_process(const ProcessRequest& request);

}  // namespace lobatto
