// SPDX-License-Identifier: GPL-2.0-or-later
// The compiler and its cache: what is compiled when, what is trusted, what survives, what people are told.
#include <dlfcn.h>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "runtime/build/compile.hpp"
#include "runtime/build/process.hpp"
#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;
namespace fs = std::filesystem;

namespace {

const Translation answer{"answer",
                         "extern \"C\" __attribute__((visibility(\"default\"))) int answer() { return 42; }\n"};

// A cache of its own and a compiler that writes a line to `runs` each time before it does its work.
struct KernelBuilder {
    TemporaryFolder folder;
    EnvironmentVariable cache{"LOBATTO_CACHE_DIR", (folder / "cache").string()};
    EnvironmentVariable compiler{"CXX", (folder / "compiler").string()};

    explicit KernelBuilder(const std::string& before = "") { set_compiler(before + "exec g++ \"$@\"\n"); }
    void set_compiler(const std::string& body) const {
        write_script(folder / "compiler", "echo run >> " + (folder / "runs").string() + "\n" + body);
    }
    long runs() const {
        if (!fs::exists(folder / "runs")) return 0;
        const std::string lines = read_file(folder / "runs");
        return std::count(lines.begin(), lines.end(), '\n');
    }
    // The names in the cache without the part that the key determines.
    std::vector<std::string> endings() const {
        std::vector<std::string> names;
        for (const auto& file : fs::directory_iterator(folder / "cache")) names.push_back(file.path().extension());
        std::sort(names.begin(), names.end());
        return names;
    }
    fs::path key_file() const {
        for (const auto& file : fs::directory_iterator(folder / "cache")) {
            if (file.path().extension() == ".key") return file.path();
        }
        return {};
    }
};

// Runs the task in a process of its own; exit code 0 when it returns true.
template <class Task>
pid_t start_process(Task task) {
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    bool is_right = false;
    try {
        is_right = task();
    } catch (...) {
    }
    ::_exit(is_right ? 0 : 1);
}

int exit_code_of(pid_t pid) {
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Whether the process is still there (and not only its name) after a moment in which it may come to its end.
bool is_running(pid_t pid) {
    for (int i = 0; i < 400; ++i) {
        std::ifstream file(fmt::format("/proc/{}/stat", pid));
        std::string status;
        if (!std::getline(file, status) || status.find(") Z ") != std::string::npos) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
}

const std::vector<std::string> one_entry = {".key", ".so"};

}  // namespace

TEST_CASE("SHA-256 has the values of the standard") {
    // FIPS 180-4 examples; lengths 0, 3, 56 (the padding needs a second block) and 1,000,000.
    CHECK(sha256("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(sha256("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    CHECK(sha256(std::string(1000000, 'a')) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("the second compilation of a text is a hit and runs no compiler") {
    const KernelBuilder kernel_builder;
    const Compiled first = compile(answer);
    CHECK_FALSE(first.from_cache);
    CHECK(first.seconds > 0);
    const Compiled second = compile(answer);
    CHECK(second.from_cache);
    CHECK(second.seconds == 0);
    CHECK(second.object == first.object);
    CHECK(second.command == first.command);
    CHECK(kernel_builder.runs() == 1);
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("another text, another compiler and another precision are misses") {
    const KernelBuilder kernel_builder;
    compile(answer);
    CHECK_FALSE(compile({answer.name, answer.text + "\n"}).from_cache);
    CHECK_FALSE(compile({answer.name, answer.text, true}).from_cache);
    kernel_builder.set_compiler("# a newer version\nexec g++ \"$@\"\n");
    CHECK_FALSE(compile(answer).from_cache);
    CHECK(kernel_builder.runs() == 4);
}

TEST_CASE("the command names the compiler that CXX names and all flags, and fuses no products") {
    const KernelBuilder kernel_builder;
    const std::string compiler = (kernel_builder.folder / "compiler").string();
    CHECK(compile(answer).command ==
          compiler +
              " -O2 -fpeel-loops -march=native -fno-math-errno -ffp-contract=off -fPIC -shared "
              "-fvisibility=hidden -std=c++17 answer.cpp -o answer.so");
    CHECK(
        compile({answer.name, answer.text, false, 0, true})
            .command.starts_with(compiler + " -O2 -fpeel-loops --param max-completely-peeled-insns=60 -march=native "));
    const EnvironmentVariable words("CXX", compiler + "  -DLOBATTO_UNUSED='a' ");
    CHECK(compile(answer).command.starts_with(compiler + " '-DLOBATTO_UNUSED='\\''a'\\''' -O2 "));
}

TEST_CASE("a level of optimisation that CXX names takes the place of ours") {
    const KernelBuilder kernel_builder;
    const std::string compiler = (kernel_builder.folder / "compiler").string();
    const EnvironmentVariable words("CXX", compiler + " -Og");
    CHECK(compile({answer.name, answer.text, false, 0, true})
              .command.starts_with(compiler + " -Og -march=native -fno-math-errno -ffp-contract=off "));
    // A kernel tells by x - x whether x is finite, which this one would simplify away. The last level counts.
    const EnvironmentVariable fast("CXX", compiler + " -Ofast");
    CHECK(compile(answer).command.starts_with(compiler + " -Ofast -O2 -fpeel-loops -march=native "));
    for (const std::string flag : {"-ffast-math", "-fsingle-precision-constant"}) {
        const EnvironmentVariable inexact("CXX", compiler + " " + flag);
        CHECK(message_of<MachineError>([&] { compile(answer); }) ==
              "the environment variable CXX asks for " + flag + ", which changes the results of kernels; leave it out");
    }
}

TEST_CASE("a product is rounded before it is added to, on every processor") {
    const KernelBuilder kernel_builder;
    const Compiled compiled =
        compile({"sum",
                 "extern \"C\" __attribute__((visibility(\"default\"))) double sum(double a, double b, double c) "
                 "{ return a * b + c; }\n"});
    void* const library = ::dlopen(compiled.object.c_str(), RTLD_NOW | RTLD_LOCAL);
    REQUIRE(library != nullptr);
    const auto sum = reinterpret_cast<double (*)(double, double, double)>(::dlsym(library, "sum"));
    const double small = std::ldexp(1.0, -30);
    CHECK(sum(1 + small, 1 - small, -1) == 0);  // a fused multiply-add gives -2^-60
    ::dlclose(library);
}

TEST_CASE("an entry whose key text is forged is built again") {
    const KernelBuilder kernel_builder;
    const std::string object = compile(answer).object;
    const std::string key = read_file(kernel_builder.key_file());
    // The seal of the object stays right: only the text differs.
    std::string forged = key;
    forged.replace(forged.find("return 42"), 9, "return 43");
    write_text(kernel_builder.key_file(), forged);
    CHECK_FALSE(compile(answer).from_cache);
    CHECK(read_file(kernel_builder.key_file()) == key);
    CHECK(compile(answer).from_cache);
}

TEST_CASE(
    "an altered, a shortened, a missing and a shared object are built again, which is told of all but a missing one") {
    const KernelBuilder kernel_builder;
    const std::string object = compile(answer).object;
    const std::string good = read_file(object);
    std::string altered = good;
    altered[good.size() / 2] ^= 1;
    long runs = kernel_builder.runs();
    const auto is_rebuilt = [&](bool told) {
        const Compiled again = compile(answer);
        return !again.from_cache && again.was_altered == told && kernel_builder.runs() == ++runs &&
               compile(answer).from_cache;
    };
    write_text(object, altered);
    CHECK(is_rebuilt(true));
    write_text(object, good.substr(0, good.size() / 2));
    CHECK(is_rebuilt(true));
    fs::remove(object);
    CHECK(is_rebuilt(false));
    fs::remove(kernel_builder.key_file());
    CHECK(is_rebuilt(false));
    fs::permissions(object, fs::perms::group_write, fs::perm_options::add);
    CHECK(is_rebuilt(true));
    fs::remove(object);
    fs::create_symlink("/bin/true", object);
    CHECK(is_rebuilt(true));
}

TEST_CASE("a permissive umask does not spoil the entries") {
    const KernelBuilder kernel_builder;
    const pid_t pid = start_process([] {
        ::umask(0);
        compile(answer);
        return compile(answer).from_cache;
    });
    CHECK(exit_code_of(pid) == 0);
}

TEST_CASE("eight processes that want the same kernel compile it once") {
    const KernelBuilder kernel_builder("sleep 0.3\n");
    std::vector<pid_t> processes;
    for (int i = 0; i < 8; ++i) processes.push_back(start_process([] { return fs::exists(compile(answer).object); }));
    for (const pid_t pid : processes) CHECK(exit_code_of(pid) == 0);
    CHECK(kernel_builder.runs() == 1);
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("eight threads that want the same kernel compile it once") {
    const KernelBuilder kernel_builder("sleep 0.3\n");
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i) threads.emplace_back([] { compile(answer); });
    for (std::thread& thread : threads) thread.join();
    CHECK(kernel_builder.runs() == 1);
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("a process killed at any time of a compilation leaves nothing broken") {
    for (const int milliseconds : {5, 40, 80, 120, 160, 300}) {
        CAPTURE(milliseconds);
        const KernelBuilder kernel_builder("sleep 0.05\n");
        const pid_t pid = start_process([] { return !compile(answer).from_cache; });
        std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
        ::kill(pid, SIGKILL);
        exit_code_of(pid);
        const Compiled next = compile(answer);
        CHECK(read_file(next.object)
                  .starts_with("\x7f"
                               "ELF"));
        CHECK(compile(answer).from_cache);
        // What is left goes as soon as something is built after the last part of the killed compiler has ended.
        const auto is_rest = [](const std::string& ending) { return ending != ".so" && ending != ".key"; };
        for (int i = 0; i < 50 && std::ranges::count_if(kernel_builder.endings(), is_rest) > 0; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            compile({"other", answer.text + std::string(i, '\n')});
        }
        CHECK(std::ranges::count_if(kernel_builder.endings(), is_rest) == 0);
    }
}

TEST_CASE("what a killed process left of an entry is removed when another entry is built") {
    const KernelBuilder kernel_builder("echo $$ > $(dirname $0)/pid\nsleep 5\n");
    const pid_t pid = start_process([] { return !compile(answer).from_cache; });
    while (!fs::exists(kernel_builder.folder / "pid")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ::kill(pid, SIGKILL);
    exit_code_of(pid);
    CHECK(kernel_builder.endings() == std::vector<std::string>{".building", ".lock"});
    kernel_builder.set_compiler("exec g++ \"$@\"\n");
    compile({"other", answer.text});
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("a compiler that nobody waits for is ended, and leaves nothing") {
    const KernelBuilder kernel_builder(
        "echo $$ > $(dirname $0)/pid.new; mv $(dirname $0)/pid.new $(dirname $0)/pid\nexec sleep 300\n");
    std::atomic<bool> abandoned = false;
    std::thread waiting([&] { CHECK_THROWS_AS(compile(answer, &abandoned), MachineError); });
    while (!fs::exists(kernel_builder.folder / "pid")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    abandoned = true;
    waiting.join();
    CHECK_FALSE(is_running(std::stoi(read_file(kernel_builder.folder / "pid"))));
    CHECK(kernel_builder.endings().empty());
    kernel_builder.set_compiler("exec g++ \"$@\"\n");
    compile(answer);
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("a compiler does not outlive the process that started it, nor what it started itself") {
    const KernelBuilder kernel_builder(
        "sleep 30 &\necho $! > $(dirname $0)/pid.new; mv $(dirname $0)/pid.new $(dirname $0)/pid\nwait\n");
    const pid_t pid = start_process([] { return !compile(answer).from_cache; });
    while (!fs::exists(kernel_builder.folder / "pid")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const pid_t compiler = std::stoi(read_file(kernel_builder.folder / "pid"));
    ::kill(pid, SIGKILL);
    exit_code_of(pid);
    CHECK_FALSE(is_running(compiler));
}

TEST_CASE("a folder that others may write to is refused") {
    const TemporaryFolder folder;
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string());
    CHECK(cache_folder() == folder.string());
    for (const fs::perms writer : {fs::perms::group_write, fs::perms::others_write}) {
        fs::permissions(folder.string(), fs::perms::owner_all | writer);
        CHECK(message_of<MachineError>([] { compile(answer); }) ==
              "the folder " + folder.string() +
                  " cannot be trusted with programs to run: other users may write to it; make it yours alone (chmod "
                  "700), or "
                  "name another folder in the environment variable LOBATTO_CACHE_DIR");
    }
}

TEST_CASE("a folder in one where others may rename it is refused, also behind a link; a sticky bit helps") {
    const TemporaryFolder folder;
    const fs::path open = folder / "open";
    fs::create_directories(open / "sub/c");
    fs::permissions(open / "sub/c", fs::perms::owner_all);
    fs::create_symlink(open / "sub", folder / "link");
    for (const std::string& path : {(open / "sub/c").string(), (folder / "link/c").string(), (open / "new").string()}) {
        const EnvironmentVariable cache("LOBATTO_CACHE_DIR", path);
        fs::permissions(open, fs::perms::owner_all | fs::perms::others_write);
        CHECK(message_of<MachineError>([] { cache_folder(); }) ==
              "the folder " + path + " cannot be trusted with programs to run: other users may rename what is in " +
                  open.string() +
                  "; take their permission to write there (chmod go-w), or name another folder in the environment "
                  "variable LOBATTO_CACHE_DIR");
        fs::permissions(open, fs::perms::all | fs::perms::sticky_bit);
        CHECK(cache_folder() == path);
        fs::permissions(open, fs::perms::owner_all | fs::perms::group_all);  // our own group: umask 002
        CHECK(cache_folder() == path);
    }
    if (::geteuid() == 0) {  // who else may give folders away?
        REQUIRE(::chown(open.c_str(), 65534, 65534) == 0);
        const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (open / "sub/c").string());
        CHECK(message_of<MachineError>([] { cache_folder(); }).find(open.string() + " belongs to another user") !=
              std::string::npos);
    }
}

TEST_CASE("a folder that others may read becomes private, with or without a stroke at its end") {
    const TemporaryFolder folder;
    for (const char* end : {"", "/"}) {
        fs::permissions(folder.string(), fs::perms(0755));
        const EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string() + end);
        CHECK(cache_folder() == folder.string());
        CHECK(fs::status(folder.string()).permissions() == fs::perms::owner_all);
    }
}

TEST_CASE("a folder that belongs to another user is refused, also behind a link") {
    const TemporaryFolder folder;
    std::string foreign = "/";
    if (::geteuid() == 0) {  // then / is ours
        foreign = (folder / "foreign").string();
        fs::create_directory(foreign);
        REQUIRE(::chown(foreign.c_str(), 65534, 65534) == 0);
    }
    fs::create_symlink(foreign, folder / "link");
    std::vector<std::string> paths = {foreign, (folder / "link").string()};
    if (::geteuid() == 0) {
        paths.push_back((folder / "foreign_link").string());
        fs::create_symlink(folder.string(), paths.back());
        REQUIRE(::lchown(paths.back().c_str(), 65534, 65534) == 0);
    }
    for (const std::string& path : paths) {
        const EnvironmentVariable cache("LOBATTO_CACHE_DIR", path);
        CHECK(message_of<MachineError>([] { compile(answer); }) ==
              "the folder " + path +
                  " cannot be trusted with programs to run: it belongs to another user; make it yours alone (chmod "
                  "700), or "
                  "name another folder in the environment variable LOBATTO_CACHE_DIR");
    }
}

TEST_CASE("the folder is private and is found through LOBATTO_CACHE_DIR, XDG_CACHE_HOME and HOME, in this order") {
    const TemporaryFolder folder;
    EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "a/b").string());
    EnvironmentVariable standard("XDG_CACHE_HOME", (folder / "standard").string());
    const EnvironmentVariable home("HOME", (folder / "home").string());
    CHECK(cache_folder() == (folder / "a/b").string());
    cache.set(std::nullopt);
    CHECK(cache_folder() == (folder / "standard/lobatto").string());
    standard.set("relative/folders/are/ignored");
    CHECK(cache_folder() == (folder / "home/.cache/lobatto").string());
    for (const char* name : {"a/b", "standard/lobatto", "home/.cache/lobatto"}) {
        CHECK(fs::status(folder / name).permissions() == fs::perms::owner_all);
    }
}

TEST_CASE("a folder that cannot be made is named with the reason") {
    const TemporaryFolder folder;
    write_text(folder / "file", "");
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "file/cache").string());
    CHECK(
        message_of<MachineError>([] { compile(answer); }) ==
        "cannot create the folder " + (folder / "file/cache").string() +
            ": Not a directory; make room or give permission there, or name another folder in the environment variable "
            "LOBATTO_CACHE_DIR");
}

TEST_CASE("a folder that cannot be made for want of permission is named with that reason") {
    TemporaryFolder folder;
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    fs::permissions(folder.string(),
                    fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read | fs::perms::others_exec);
    const pid_t pid = start_process([&] {
        if (::geteuid() == 0 && ::setuid(65534) != 0) return false;  // root may write everywhere
        return message_of<MachineError>([] { compile(answer); })
            .starts_with("cannot create the folder " + (folder / "cache").string() + ": Permission denied;");
    });
    CHECK(exit_code_of(pid) == 0);
    fs::permissions(folder.string(), fs::perms::owner_all);
}

TEST_CASE("a folder without permission to write is named with the reason, but what is in it is used") {
    TemporaryFolder folder;
    fs::permissions(folder.string(), fs::perms::all | fs::perms::sticky_bit);  // for another user, too
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const pid_t pid = start_process([&] {
        if (::geteuid() == 0 && ::setuid(65534) != 0) return false;  // root may write everywhere
        compile(answer);
        fs::permissions(folder / "cache", fs::perms::owner_read | fs::perms::owner_exec);
        const std::string message = message_of<MachineError>([] { compile({"other", answer.text}); });
        return compile(answer).from_cache &&
               message.starts_with("cannot create " + (folder / "cache/other-").string()) &&
               message.ends_with(
                   ".lock: Permission denied; make room or give permission there, or name another folder in the "
                   "environment variable LOBATTO_CACHE_DIR");
    });
    CHECK(exit_code_of(pid) == 0);
}

TEST_CASE("a compiler that fails is quoted, and source, command and output are kept") {
    const KernelBuilder kernel_builder;
    kernel_builder.set_compiler("echo \"$0: fatal error: no room on the couch\" >&2\nseq 100\nexit 3\n");
    const std::string compiler = (kernel_builder.folder / "compiler").string();
    const std::string message = message_of<MachineError>([] { compile(answer); });
    fs::path kept;
    for (const auto& file : fs::directory_iterator(kernel_builder.folder / "cache")) kept = file.path();
    std::string lines;
    for (int i = 1; i < 40; ++i) lines += std::to_string(i) + "\n";
    const std::string command =
        compiler +
        " -O2 -fpeel-loops -march=native -fno-math-errno -ffp-contract=off -fPIC -shared -fvisibility=hidden "
        "-std=c++17 answer.cpp -o answer.so";
    CHECK(message == "the C++ compiler failed with exit code 3.\nCommand: " + command + "\nIts output:\n" + compiler +
                         ": fatal error: no room on the couch\n" + lines +
                         "[...]\nSource, command and whole output are kept in " + kept.string());
    CHECK(kernel_builder.endings() == std::vector<std::string>{".failed"});
    CHECK(read_file(kept / "answer.cpp") == answer.text);
    CHECK(read_file(kept / "command") == command + "\n");
    CHECK(read_file(kept / "output").ends_with("\n99\n100\n"));
}

TEST_CASE("a compiler that writes nothing and calls it success is named") {
    const KernelBuilder kernel_builder;
    kernel_builder.set_compiler("exit 0\n");
    CHECK(message_of<MachineError>([] { compile(answer); })
              .starts_with("the C++ compiler " + (kernel_builder.folder / "compiler").string() +
                           " ended well but wrote no answer.so; correct the environment variable CXX, or unset it to "
                           "use g++ or clang++.\nCommand: "));
    CHECK(kernel_builder.endings() == std::vector<std::string>{".failed"});
}

TEST_CASE("what is kept of a failure goes when the same compilation succeeds") {
    const KernelBuilder kernel_builder("test -e $(dirname $0)/memory || exit 1\n");
    CHECK(message_of<MachineError>([] { compile(answer); }) != "");
    CHECK(kernel_builder.endings() == std::vector<std::string>{".failed"});
    write_text(kernel_builder.folder / "memory", "");
    compile(answer);
    CHECK(kernel_builder.endings() == one_entry);
}

TEST_CASE("a compiler that a signal ended is told apart from one that failed") {
    const KernelBuilder kernel_builder("kill -9 $$\n");
    CHECK(message_of<MachineError>([] { compile(answer); })
              .starts_with(
                  "the C++ compiler was ended by signal 9 (Killed); a common cause is too little memory.\nCommand: "));
}

TEST_CASE("a program that does not finish is ended, with everything it started") {
    const auto start = std::chrono::steady_clock::now();
    const ProcessResult result =
        run_process({{"/bin/sh", "-c", "echo begun; sleep 60 & echo $!; sleep 60"}, "/", {}, 0.2});
    CHECK(result.timed_out);
    CHECK_FALSE(result.succeeded());
    REQUIRE(result.output.starts_with("begun\n"));
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(50));
    CHECK_FALSE(is_running(std::stoi(result.output.substr(6))));
}

TEST_CASE("a program that nobody waits for any longer is ended") {
    const auto start = std::chrono::steady_clock::now();
    ProcessRequest request{{"/bin/sleep", "60"}, "/", {}, 50};
    const volatile int interrupted = 1;
    request.interrupted = &interrupted;
    CHECK(run_process(request).abandoned);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(40));
}

TEST_CASE("a program's output is taken up to its limit and not waited for when a child keeps it open") {
    const ProcessResult result =
        run_process({{"/bin/sh", "-c", "yes | head -c 3000000; sleep 60 & exit 7"}, "/", {}, 50});
    CHECK(result.exit_code == 7);
    CHECK(result.output.size() == 1 << 20);
    CHECK(run_process({{"/bin/cat"}, "/", {}, 50}).succeeded());  // standard input is empty
    const ProcessResult left_behind = run_process({{"/bin/sh", "-c", "sleep 60 & echo $!"}, "/", {}, 50});
    CHECK(left_behind.succeeded());
    CHECK_FALSE(is_running(std::stoi(left_behind.output)));
}

TEST_CASE("where children are not told of, a program is not taken for one that succeeded, and lobatto tells of them") {
    {
        const auto before = ::signal(SIGCHLD, SIG_IGN);
        const auto start = std::chrono::steady_clock::now();
        std::string said;
        try {
            run_process({{"/bin/false"}, "/", {}, 50});
        } catch (const MachineError& error) {
            said = error.what();
        }
        ::signal(SIGCHLD, before);
        CHECK(said.find("is SIGCHLD ignored in this process?") != std::string::npos);
        CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(40));
    }
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable own("LOBATTO_CACHE_DIR", folder / "cache");
    const test::Finished done =
        test::run({"env", "--ignore-signal=CHLD", LOBATTO_PROGRAM, "run", LOBATTO_SOURCE_DIR "/scenes/pendulum.toml",
                   "--until", "1", "-o", folder / "run.csv"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
}

TEST_CASE("the words of the real compiler reach the reader") {
    const KernelBuilder kernel_builder;
    const std::string message = message_of<MachineError>([] {
        compile({"wrong", "int answer() { return forty_two; }\n"});
    });
    CHECK(message.find("wrong.cpp:1:23: error: ") != std::string::npos);
    CHECK(message.find("int answer() { return forty_two; }") != std::string::npos);
}

TEST_CASE("without a compiler people are told what was looked for and what to do") {
    const TemporaryFolder folder;
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    EnvironmentVariable compiler("CXX", std::nullopt);
    const EnvironmentVariable path("PATH", folder.string());
    const auto message = [](bool quadruple) {
        return message_of<MachineError>([&] { compile({answer.name, answer.text, quadruple}); });
    };
    CHECK(message(false) == "no C++ compiler: looked for g++ and clang++ in PATH (" + folder.string() +
                                "); install one (apt-get install g++) or name one in the environment variable CXX");
    write_script(folder / "clang++", "exit 1\n");
    CHECK(message(true) == "no C++ compiler: looked for g++ (quadruple precision needs it) in PATH (" +
                               folder.string() +
                               "); install one (apt-get install g++) or name one in the environment variable CXX");
    compiler.set("clang++ -g");
    CHECK(message(true) ==
          "quadruple precision needs g++ and its libquadmath, but the environment variable CXX names " +
              (folder / "clang++").string() + "; set CXX=g++");
    compiler.set("icpc");
    CHECK(message(false) ==
          "the C++ compiler 'icpc' that the environment variable CXX names is not a program in PATH (" +
              folder.string() + "); correct CXX, or unset it to use g++ or clang++");
}

TEST_CASE("a compiler that cannot be started is named with the reason") {
    const KernelBuilder kernel_builder;
    const fs::path compiler = kernel_builder.folder / "compiler";
    write_text(compiler, "#!/no/such/interpreter\n");
    CHECK(message_of<MachineError>([] { compile(answer); }) ==
          "cannot run " + compiler.string() + ": exec: No such file or directory");
}

TEST_CASE("a folder in the place of a compiled kernel is replaced") {
    const KernelBuilder builder;
    for (const char* ending : {".so", ".key"}) {
        REQUIRE(compile(answer).object != "");
        for (const auto& file : fs::directory_iterator(builder.folder / "cache"))
            if (file.path().extension() == ending) {
                const fs::path path = file.path();
                fs::remove(path);
                fs::create_directories(path / "something");
                break;
            }
        const Compiled compiled = compile(answer);
        CHECK(fs::is_regular_file(compiled.object));
        CHECK(compile(answer).from_cache);
    }
}
