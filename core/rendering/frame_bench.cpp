// Draws the example scene many times and prints how long a frame takes. Also writes its picture.
//   calot_frame_bench [triangles] [frames] [width] [height] [picture.png]
#include "rendering/egl_context.hpp"
#include "rendering/example_scene.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/png.hpp"
#include "rendering/renderer.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>

namespace {

using namespace calot::rendering;

double median(std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
}

// Of all threads of this process: with other programs running, steadier than the clock on the wall.
double processor_ms() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

int run(int argc, char** argv) {
    const auto number = [&](int i, int fallback, int low, int high) {
        return argc > i ? std::clamp(std::atoi(argv[i]), low, high) : fallback;
    };
    const int triangles = number(1, 100000, 100, 4000000), frames = number(2, 60, 1, 100000);
    RendererSettings settings;
    settings.width = number(3, 1280, 64, 8192);
    settings.height = number(4, 640, 64, 8192);
    if (const char* samples = std::getenv("CALOT_SAMPLES")) settings.samples = std::atoi(samples);
    if (const char* scale = std::getenv("CALOT_SCALE")) settings.scale = std::atof(scale);
    limit_software_threads();
    EglContext context;
    Renderer renderer(settings);
    ExampleScene scene = make_example_scene(triangles);
    std::size_t count = 0;
    for (const Surface& s : scene.surfaces) {
        renderer.add(s);
        count += s.triangles.size();
    }
    std::printf("%s; %zu triangles, %d x %d\n", describe_context().c_str(), count, settings.width,
                settings.height);
    Image image;
    for (const bool external : {true, false}) {
        scene.frame.external.on = external;
        std::vector<double> ms, busy;
        for (int i = 0; i < frames; ++i) {
            scene.frame.time += 1.0 / 60;
            const double before = processor_ms();
            const auto start = std::chrono::steady_clock::now();
            renderer.draw(scene.frame);
            renderer.read(image);
            ms.push_back(
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
            busy.push_back(processor_ms() - before);
        }
        std::printf("%-18s median %6.2f ms, worst %6.2f ms, processor %6.2f ms a frame (with read back)\n",
                    external ? "both views" : "endoscope alone", median(ms),
                    *std::max_element(ms.begin(), ms.end()), median(busy));
        if (argc > 5) write_png(external ? argv[5] : std::string(argv[5]) + "-alone.png", image);
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "calot_frame_bench: %s\n", error.what());
        return 2;
    }
}
