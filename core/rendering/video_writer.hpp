// Videos through the program ffmpeg.
#pragma once

#include "rendering/types.hpp"

#include <filesystem>
#include <string>
#include <sys/types.h>

namespace calot::rendering {

/// Pipes frames to a child process that encodes them (H.264 in MP4, yuv420p). No shell is involved. A case
/// that ends without finish() still leaves a playable file: the file is written in fragments of two seconds.
class VideoWriter {
  public:
    /// Odd sizes lose their last row or column (yuv420p needs even ones). Needs no GL context. Any one
    /// thread. Throws std::runtime_error: ffmpeg missing (package ffmpeg), file not writable, size or rate
    /// out of range.
    VideoWriter(const std::filesystem::path& file, int width, int height, int frames_per_second);

    /// Closes without throwing; the file then holds what was encoded.
    ~VideoWriter();
    VideoWriter(const VideoWriter&) = delete;
    VideoWriter& operator=(const VideoWriter&) = delete;

    /// Throws std::runtime_error with ffmpeg's last words if it has ended, std::invalid_argument for a
    /// picture of another size.
    void write(const Image&);

    /// Waits until the file is complete. Throws std::runtime_error with ffmpeg's last words if encoding
    /// failed.
    void finish();

    const std::filesystem::path& file() const { return file_; }
    std::size_t frames() const { return frames_; }

  private:
    std::string close(); // what went wrong, or nothing

    std::filesystem::path file_;
    int width_, height_;
    pid_t child_ = -1;
    int frames_out_ = -1; // to ffmpeg's standard input
    int words_in_ = -1;   // from its standard error
    std::size_t frames_ = 0;
};

} // namespace calot::rendering
