// SPDX-License-Identifier: MIT
#include "runtime/build/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "runtime/error.hpp"

namespace lobatto {
namespace {

constexpr std::size_t output_limit = 1 << 20;

// An open file descriptor, closed at the end of its scope.
class Descriptor {
public:
    explicit Descriptor(int value = -1) : value_(value) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { close(); }
    void close() {
        if (value_ >= 0) ::close(value_);
        value_ = -1;
    }
    int operator*() const { return value_; }
    int* address() { return &value_; }

private:
    int value_;
};

[[noreturn]] void fail(const ProcessRequest& request, const std::string& what, int error) {
    throw MachineError(fmt::format("cannot run {}: {}: {}", request.arguments[0], what, std::strerror(error)));
}

std::vector<std::string> environment_with(const std::vector<std::pair<std::string, std::string>>& additions) {
    std::vector<std::string> entries;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string text = *entry;
        const auto replaces = [&](const auto& addition) { return text.starts_with(addition.first + "="); };
        if (std::none_of(additions.begin(), additions.end(), replaces)) entries.push_back(text);
    }
    for (const auto& [name, value] : additions) entries.push_back(name + "=" + value);
    return entries;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

// What the child does: async-signal-safe calls only, since other threads may hold locks. It leads a group of processes,
// and its child becomes the program. When the calling thread dies, it kills the group: a compiler has children, too.
struct Child {
    const char* folder;
    char* const* arguments;
    char* const* environment;
    int input, output, error_report;
    pid_t parent;

    [[noreturn]] void lead() const {
        ::setpgid(0, 0);
        for (const int signal : {SIGINT, SIGQUIT, SIGPIPE, SIGCHLD, SIGHUP, SIGXFSZ}) std::signal(signal, SIG_DFL);
        std::signal(SIGTERM, [](int) { ::kill(0, SIGKILL); });
        sigset_t none;
        sigemptyset(&none);
        ::sigprocmask(SIG_SETMASK, &none, nullptr);
        ::prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (::getppid() != parent) ::_exit(127);  // it died before the line above
        const pid_t program = ::_Fork();          // without what libraries do at a fork
        if (program == 0) become_program();
        if (program < 0) report_error();
        ::close(output);
        ::close(error_report);
        ::close_range(3, ~0U, 0);  // and the caller's files, whose locks it would hold
        int status = 0;
        while (::waitpid(program, &status, 0) < 0 && errno == EINTR) {
        }
        if (WIFSIGNALED(status)) {
            std::signal(WTERMSIG(status), SIG_DFL);
            ::raise(WTERMSIG(status));
        }
        ::_exit(WEXITSTATUS(status));
    }

    [[noreturn]] void become_program() const {
        std::signal(SIGTERM, SIG_DFL);
        if (::dup2(input, 0) >= 0 && ::dup2(output, 1) >= 0 && ::dup2(output, 2) >= 0 && ::chdir(folder) == 0) {
            ::execve(arguments[0], arguments, environment);
        }
        report_error();
    }

    [[noreturn]] void report_error() const {
        const int error = errno;
        [[maybe_unused]] const ssize_t written = ::write(error_report, &error, sizeof error);
        ::_exit(127);
    }
};

// Reads what is there without waiting; false at the end of the stream.
bool drain(int descriptor, std::string& output) {
    char block[16384];
    while (true) {
        const ssize_t count = ::read(descriptor, block, sizeof block);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return errno == EAGAIN;
        if (count == 0) return false;
        output.append(block, std::min(std::size_t(count), output_limit - output.size()));
    }
}

}  // namespace

ProcessResult run_process(const ProcessRequest& request) {
    std::vector<std::string> argument_texts = request.arguments;
    std::vector<std::string> environment_texts = environment_with(request.environment);
    const std::vector<char*> arguments = pointers_to(argument_texts);
    const std::vector<char*> environment = pointers_to(environment_texts);

    int ends[2], report_ends[2];
    const Descriptor input(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (*input < 0) fail(request, "/dev/null", errno);
    if (::pipe2(ends, O_CLOEXEC) != 0) fail(request, "pipe", errno);
    Descriptor output_end(ends[0]), output_start(ends[1]);
    if (::pipe2(report_ends, O_CLOEXEC) != 0) fail(request, "pipe", errno);
    Descriptor report_end(report_ends[0]), report_start(report_ends[1]);

    const Child child{request.folder.c_str(), arguments.data(), environment.data(), *input,
                      *output_start,          *report_start,    ::getpid()};
    const pid_t pid = ::fork();
    if (pid < 0) fail(request, "fork", errno);
    if (pid == 0) child.lead();
    ::setpgid(pid, pid);  // also here: whoever comes first
    output_start.close();
    report_start.close();

    int error = 0;
    ssize_t reported;
    do reported = ::read(*report_end, &error, sizeof error);
    while (reported < 0 && errno == EINTR);
    if (reported == sizeof error) {
        ::waitpid(pid, nullptr, 0);
        fail(request, "exec", error);
    }

    ProcessResult result;
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + std::chrono::duration<double>(request.seconds_limit);
    ::fcntl(*output_end, F_SETFL, O_NONBLOCK);
    pollfd watched = {*output_end, POLLIN, 0};
    siginfo_t ended{};
    while (ended.si_pid == 0) {
        result.timed_out = Clock::now() >= deadline;
        result.abandoned = (request.abandoned != nullptr && *request.abandoned) ||
                           (request.interrupted != nullptr && *request.interrupted != 0);
        if (result.timed_out || result.abandoned) ::kill(-pid, SIGKILL);
        // The output ends together with the process, unless one of the two is strange: then look again every 100 ms or
        // every 1 ms.
        ::poll(&watched, 1, watched.fd >= 0 ? 100 : 1);
        if (watched.fd >= 0 && !drain(*output_end, result.output)) watched.fd = -1;
        // Not reaped yet: until the group is killed, its number must not be given to another.
        if (::waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOWAIT | WNOHANG) != 0 && errno != EINTR)
            fail(request, "wait (is SIGCHLD ignored in this process?)", errno);
    }
    ::kill(-pid, SIGKILL);
    int status = 0;
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
    drain(*output_end, result.output);
    if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
    return result;
}

}  // namespace lobatto
