// SPDX-License-Identifier: GPL-2.0-or-later
// The page as a video: its own code draws the frames in a browser without a window, ffmpeg joins them.
#pragma once

#include <string>

namespace lobatto {

// InputError for an ending other than .mp4 and .gif.
void check_video_name(const std::string& path);

// `seconds` of what the page shows. Needs chromium (or google-chrome) and ffmpeg: MachineError where one is missing or
// fails.
void write_video(const std::string& page, const std::string& path, double seconds);

}  // namespace lobatto
