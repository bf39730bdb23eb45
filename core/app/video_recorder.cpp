#include "app/video_recorder.hpp"

#include "host/error.hpp"
#include "rendering/egl_context.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/orbit_camera.hpp"
#include "rendering/video_writer.hpp"

#include <array>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace calot::app {
namespace {

constexpr int width = 1280, height = 720;
constexpr int rate_with_gpu = 30, rate_without = 15; // pictures a simulated second
constexpr std::size_t places = 4;                    // snapshots that wait to be drawn

} // namespace

struct VideoRecorder::Impl {
    std::filesystem::path file;
    CasePicture picture;
    bool may_wait;
    int rate = rate_with_gpu; // settled before is_ready

    std::mutex mutex;
    std::condition_variable changed;
    std::array<simulation::Snapshot, places> ring;
    std::size_t first = 0, count = 0;   // of ring; guarded
    bool is_over = false;               // no more will come; guarded
    std::optional<std::string> problem; // guarded
    bool is_ready = false;              // the thread can draw; guarded
    std::size_t frames = 0, missed = 0; // guarded
    std::int64_t next_picture = 0;      // of the simulation thread
    std::thread thread;

    Impl(const std::filesystem::path& where, const simulation::World& world,
         const std::vector<simulation::TaskState>& tasks, bool waits)
        : file(where), picture(world, tasks), may_wait(waits) {}

    void draw_all() {
        try {
            const rendering::EglContext context;
            if (rendering::draws_on_processor()) rate = rate_without;
            rendering::RendererSettings settings = picture.settings(width, height);
            settings.text_scale = 0.8; // three lines fit below the endoscope's picture
            rendering::Renderer renderer(settings);
            picture.add_surfaces(renderer);
            rendering::OrbitCamera camera;
            camera.frame(picture.centre(), picture.radius(), rendering::ExternalCamera().vertical_field);
            rendering::VideoWriter writer(file, width, height, rate);
            tell([&] { is_ready = true; });
            rendering::Image image;
            while (const simulation::Snapshot* snapshot = next()) {
                rendering::FrameState frame = picture.frame(*snapshot);
                frame.external.pose = camera.pose();
                frame.endoscope_text = launcher::status_lines(picture.status(*snapshot));
                done();
                renderer.draw(frame);
                renderer.read(image);
                writer.write(image);
            }
            writer.finish();
        } catch (const std::exception& e) {
            tell([&] { problem = e.what(); });
        }
    }

    template<class Change>
    void tell(Change&& change) {
        {
            const std::lock_guard lock(mutex);
            change();
        }
        changed.notify_all();
    }

    // The next snapshot to draw, valid until done(); null at the end.
    const simulation::Snapshot* next() {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return count > 0 || is_over; });
        return count > 0 ? &ring[first] : nullptr;
    }
    void done() {
        tell([&] { first = (first + 1) % places, --count, ++frames; });
    }

    void take(const simulation::Snapshot& snapshot) {
        std::unique_lock lock(mutex);
        if (may_wait) changed.wait(lock, [&] { return count < places || problem; });
        if (count == places || problem) {
            ++missed;
            return;
        }
        simulation::Snapshot& place = ring[(first + count) % places];
        lock.unlock(); // the place is this thread's until count grows
        place = snapshot;
        tell([&] { ++count; });
    }

    void check() {
        const std::lock_guard lock(mutex);
        if (problem) throw host::UserError(file.string(), "--video", *problem);
    }
};

VideoRecorder::VideoRecorder(const std::filesystem::path& file, const simulation::World& world,
                             const std::vector<simulation::TaskState>& tasks, bool may_wait)
    : impl_(std::make_unique<Impl>(file, world, tasks, may_wait)) {
    impl_->thread = std::thread([this] { impl_->draw_all(); });
    {
        std::unique_lock lock(impl_->mutex);
        impl_->changed.wait(lock, [&] { return impl_->is_ready || impl_->problem; });
    }
    if (impl_->problem) {
        impl_->thread.join();
        impl_->check();
    }
}

VideoRecorder::~VideoRecorder() {
    if (!impl_->thread.joinable()) return;
    impl_->tell([&] { impl_->is_over = true; });
    impl_->thread.join();
}

void VideoRecorder::began(const simulation::Snapshot& snapshot) {
    impl_->take(snapshot);
    impl_->next_picture = 1;
}

void VideoRecorder::ticked(const simulation::Snapshot& snapshot) {
    if (snapshot.tick < impl_->next_picture * 1000 / impl_->rate) return;
    ++impl_->next_picture;
    impl_->take(snapshot);
}

void VideoRecorder::ended(const simulation::Snapshot& snapshot) {
    impl_->take(snapshot);
}

void VideoRecorder::finish() {
    if (impl_->thread.joinable()) {
        impl_->tell([&] { impl_->is_over = true; });
        impl_->thread.join();
    }
    impl_->check();
}

std::size_t VideoRecorder::frames() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->frames;
}
std::size_t VideoRecorder::missed() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->missed;
}

} // namespace calot::app
