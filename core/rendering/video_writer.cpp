#include "rendering/video_writer.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <pthread.h>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char** environ;

namespace calot::rendering {
namespace {

// A pipe whose ends no child inherits unless it is given one.
std::array<int, 2> make_pipe() {
    std::array<int, 2> ends{-1, -1};
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
        throw std::runtime_error(std::string("video: no pipe: ") + std::strerror(errno));
    return ends;
}

// While it lives, writing to a pipe that nobody reads is an error on this thread instead of a signal.
class NoPipeSignal {
  public:
    NoPipeSignal() {
        sigemptyset(&pipe_);
        sigaddset(&pipe_, SIGPIPE);
        sigset_t pending;
        sigpending(&pending);
        was_pending_ = sigismember(&pending, SIGPIPE) == 1;
        pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
    }
    ~NoPipeSignal() {
        if (!was_pending_) {
            const timespec now{};
            while (sigtimedwait(&pipe_, nullptr, &now) == -1 && errno == EINTR) {
            }
        }
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    NoPipeSignal(const NoPipeSignal&) = delete;
    NoPipeSignal& operator=(const NoPipeSignal&) = delete;

  private:
    sigset_t pipe_{}, before_{};
    bool was_pending_ = false;
};

} // namespace

VideoWriter::VideoWriter(const std::filesystem::path& file, int width, int height, int rate)
    : file_(file), width_(width), height_(height) {
    if (width < 2 || height < 2 || width > 8192 || height > 8192)
        throw std::runtime_error("video: width and height must lie in 2..8192");
    if (rate < 1 || rate > 240) throw std::runtime_error("video: frames per second must lie in 1..240");
    const int probe = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (probe < 0) throw std::runtime_error(file.string() + ": cannot be written: " + std::strerror(errno));
    ::close(probe);

    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    const std::string even =
        "crop=" + std::to_string(width & ~1) + ":" + std::to_string(height & ~1) + ":0:0";
    const std::string frames = std::to_string(rate), key = std::to_string(2 * rate);
    // "file:" keeps ffmpeg from reading a protocol into the name.
    const std::string target = "file:" + std::filesystem::absolute(file).string();
    std::vector<std::string> words{"ffmpeg",    "-hide_banner",
                                   "-loglevel", "error",
                                   "-nostdin",  "-y",
                                   "-f",        "rawvideo",
                                   "-pix_fmt",  "rgba",
                                   "-s",        size,
                                   "-r",        frames,
                                   "-i",        "pipe:0",
                                   "-vf",       even,
                                   "-c:v",      "libx264",
                                   "-preset",   "veryfast",
                                   "-crf",      "21",
                                   "-threads",  "1",
                                   "-pix_fmt",  "yuv420p",
                                   "-g",        key,
                                   "-movflags", "+frag_keyframe+empty_moov+default_base_moof",
                                   "-f",        "mp4",
                                   target};
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);

    const auto in = make_pipe();
    const auto out = make_pipe();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDERR_FILENO);
    // The child must not inherit a blocked or ignored SIGPIPE, nor die with the terminal's Ctrl-C before its
    // file is complete.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, defaults;
    sigemptyset(&none);
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    const int error = posix_spawnp(&child_, "ffmpeg", &actions, &attributes, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    ::close(in[0]);
    ::close(out[1]);
    if (error != 0) {
        child_ = -1;
        ::close(in[1]);
        ::close(out[0]);
        throw std::runtime_error(
            error == ENOENT
                ? std::string("video: the program ffmpeg is not installed; install the package ffmpeg")
                : std::string("video: ffmpeg cannot be started: ") + std::strerror(error));
    }
    frames_out_ = in[1];
    words_in_ = out[0];
}

VideoWriter::~VideoWriter() {
    close();
}

void VideoWriter::write(const Image& image) {
    if (image.width != width_ || image.height != height_)
        throw std::invalid_argument("video: the picture's size has changed");
    if (frames_out_ < 0) throw std::runtime_error(file_.string() + ": the video is closed already");
    NoPipeSignal guard;
    std::size_t done = 0;
    while (done < image.rgba.size()) {
        const ssize_t n = ::write(frames_out_, image.rgba.data() + done, image.rgba.size() - done);
        if (n >= 0) {
            done += static_cast<std::size_t>(n);
        } else if (errno != EINTR) {
            const std::string reason = std::strerror(errno), said = close();
            throw std::runtime_error(file_.string() +
                                     ": the video ends here: " + (said.empty() ? reason : said));
        }
    }
    ++frames_;
}

std::string VideoWriter::close() {
    if (child_ < 0) return {};
    ::close(frames_out_);
    frames_out_ = -1;
    std::string words;
    std::array<char, 512> buffer{};
    for (;;) { // until ffmpeg closes its end; what it says beyond a few lines is not kept
        const ssize_t n = ::read(words_in_, buffer.data(), buffer.size());
        if (n > 0 && words.size() < 4096) words.append(buffer.data(), static_cast<std::size_t>(n));
        if (n == 0 || (n < 0 && errno != EINTR)) break;
    }
    ::close(words_in_);
    words_in_ = -1;
    int status = 0;
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
    while (!words.empty() && words.back() == '\n')
        words.pop_back();
    return words.empty() ? "ffmpeg failed" : "ffmpeg: " + words;
}

void VideoWriter::finish() {
    const std::string wrong = close();
    if (!wrong.empty()) throw std::runtime_error(file_.string() + ": " + wrong);
}

} // namespace calot::rendering
