// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/view/video.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "cli/options/command_line.hpp"
#include "cli/print/interruption.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/build/process.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/files/scratch_folder.hpp"

namespace lobatto {

namespace {

namespace fs = std::filesystem;

constexpr int frames_a_second = 30, width = 1280, height = 860, not_found = 127;
constexpr double longest_work = 600;  // seconds

// The exit code; what it says on standard output goes into a file, as a page with its frames is long.
ProcessResult run_into(const std::string& output, const std::string& folder, std::vector<std::string> command) {
    ProcessRequest request;
    request.arguments = {"/bin/sh", "-c", "output=$1; shift; exec \"$@\" > \"$output\"", "sh", output};
    request.arguments.insert(request.arguments.end(), command.begin(), command.end());
    request.folder = folder;
    request.seconds_limit = longest_work;
    request.interrupted = Interruption::flag();
    ProcessResult result = run_process(request);
    if (*Interruption::flag() != 0) throw ExitCode{interrupted_exit};
    return result;
}

// As a part of an address.
std::string in_address(const std::string& path) {
    std::string text;
    for (const char c : path) {
        const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("/._~-", c) != nullptr;
        text += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return text;
}

// The page after its script has run.
std::string page_with_frames(const std::string& page, const ScratchFolder& frames, int count) {
    const std::string dom = frames / "page.html";
    for (const char* browser : {"chromium", "google-chrome", "chromium-browser"}) {
        std::vector<std::string> command{browser,
                                         "--headless",
                                         "--disable-gpu",
                                         "--hide-scrollbars",
                                         "--disable-extensions",
                                         "--no-first-run",
                                         "--disable-background-networking",
                                         "--user-data-dir=" + (frames / "profile"),
                                         fmt::format("--window-size={},{}", width, height),
                                         "--dump-dom"};
        if (::geteuid() == 0) command.push_back("--no-sandbox");  // which the administrator cannot have
        command.push_back(
            fmt::format("file://{}#frames={},{}", in_address(fs::absolute(page).string()), count, frames_a_second));
        const ProcessResult result = run_into(dom, frames.path(), command);
        if (result.exit_code == not_found) continue;
        if (!result.succeeded())
            throw MachineError(
                fmt::format("{} could not draw the frames of the video: {}", browser, result.output.substr(0, 400)));
        return read_whole(dom).value_or("");
    }
    throw MachineError("--video: frames are drawn by a browser, and there is none. Install it (apt install chromium)");
}

std::string from_base64(std::string_view text) {
    std::array<int, 256> value{};
    value.fill(-1);
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < digits.size(); ++i) value[static_cast<unsigned char>(digits[i])] = static_cast<int>(i);
    std::string bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int digit = value[static_cast<unsigned char>(c)];
        if (digit < 0) continue;
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += static_cast<char>(bits >> count & 0xff);
    }
    return bytes;
}

// One file each: 00000.jpg, 00001.jpg, ... How many.
int write_frames(const std::string& page, const ScratchFolder& frames) {
    const std::string mark = "<pre id=\"frames\">";
    const std::size_t begin = page.find(mark);
    if (begin == std::string::npos) return 0;
    const std::string_view text =
        std::string_view(page).substr(begin + mark.size(), page.find("</pre>", begin) - begin - mark.size());
    int count = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::ofstream(frames / fmt::format("{:05}.jpg", count++), std::ios::binary)
            << from_base64(text.substr(at, end - at));
        at = end + 1;
    }
    return count;
}

}  // namespace

void check_video_name(const std::string& path) {
    if (!path.ends_with(".mp4") && !path.ends_with(".gif"))
        throw InputError(fmt::format("--video: {} is neither a .mp4 nor a .gif", path));
}

void write_video(const std::string& page, const std::string& path, double seconds) {
    const Interruption interruption;  // the frames go, whatever happens
    const ScratchFolder frames((fs::temp_directory_path() / "lobatto-video-").string(), "the frames of", path);
    const int count = std::max(1, static_cast<int>(seconds * frames_a_second));
    if (write_frames(page_with_frames(page, frames, count), frames) != count)
        throw MachineError("--video: the browser did not draw all frames. Is there enough memory and room in /tmp?");
    const bool is_gif = path.ends_with(".gif");
    const std::string video = frames / (is_gif ? "video.gif" : "video.mp4");
    std::vector<std::string> command{
        "ffmpeg", "-loglevel", "error", "-framerate", std::to_string(frames_a_second), "-i", frames / "%05d.jpg"};
    const std::vector<std::string> as_gif{
        "-vf",
        "fps=15,scale=720:-1:flags=lanczos,split[a][b];[a]palettegen=max_colors=64[p];[b][p]paletteuse=dither=none"},
        as_mp4{"-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"};
    const std::vector<std::string>& encoding = is_gif ? as_gif : as_mp4;
    command.insert(command.end(), encoding.begin(), encoding.end());
    command.push_back(video);
    const ProcessResult result = run_into(frames / "log", frames.path(), command);
    if (result.exit_code == not_found)
        throw MachineError("--video: ffmpeg is missing. Install it (apt install ffmpeg)");
    if (!result.succeeded()) throw MachineError(fmt::format("ffmpeg could not write {}: {}", path, result.output));
    write_whole(path, "the video", read_whole(video).value_or(""), "choose another name");
}

}  // namespace lobatto
