// Draws an anatomy (assets/anatomy/*/anatomy.toml) with an endoscope pushed along its path, for looking at.
//   calot_anatomy_picture ANATOMY.toml PICTURE.png [along 0..1] [width] [height] [bearing degrees] [style
//   solid|veil|cut] [samples]
#include "rendering/egl_context.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/linear.hpp"
#include "rendering/mesh_surface.hpp"
#include "rendering/png.hpp"
#include "rendering/renderer.hpp"

#include <calot/meshio/read.hpp>

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>
#include <stdexcept>

namespace {

using namespace calot::rendering;

Vec3 vec3(const toml::node* node) {
    const toml::array* a = node ? node->as_array() : nullptr;
    if (!a || a->size() != 3) throw std::runtime_error("anatomy: a place must be three numbers");
    return {a->get(0)->value_or(0.0), a->get(1)->value_or(0.0), a->get(2)->value_or(0.0)};
}

int run(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(stderr,
                     "usage: %s ANATOMY.toml PICTURE.png [along] [width] [height] [bearing] [solid|veil|cut] "
                     "[samples]\n",
                     argv[0]);
        return 2;
    }
    const std::filesystem::path file = argv[1];
    const toml::table anatomy = toml::parse_file(file.string());
    const double along = argc > 3 ? std::clamp(std::atof(argv[3]), 0.02, 1.0) : 0.6;
    RendererSettings settings;
    settings.scale = 1;
    if (argc > 4) settings.width = std::atoi(argv[4]);
    if (argc > 5) settings.height = std::atoi(argv[5]);
    const double bearing = (argc > 6 ? std::atof(argv[6]) : 20.0) * std::numbers::pi / 180;
    const std::string style = argc > 7 ? argv[7] : "veil";
    if (argc > 8) settings.samples = std::atoi(argv[8]);
    limit_software_threads();
    EglContext context;
    Renderer renderer(settings);
    FrameState frame;
    Eigen::AlignedBox3d box;
    for (const toml::node& node : *anatomy["organ"].as_array()) {
        const toml::table& organ = *node.as_table();
        const auto mesh =
            calot::meshio::read_mesh(file.parent_path() / organ["mesh"].value_or(std::string()));
        const toml::table* looks = organ["appearance"].as_table();
        const std::string whole = organ["appearance"].value_or(std::string("serosa"));
        const SurfaceId id = renderer.add(to_surface(mesh, [&](const std::string& region) {
            return looks ? (*looks)[region].value_or(std::string("serosa")) : whole;
        }));
        for (const auto& v : mesh.vertices)
            box.extend(Eigen::Vector3d(v[0], v[1], v[2]));
        frame.surfaces.push_back({id,
                                  style == "solid" ? Style::Solid
                                  : style == "cut" ? Style::Cut
                                                   : Style::Translucent,
                                  {}});
    }
    std::vector<Vec3> path;
    for (const toml::node& point : *anatomy["landmark"]["path"]["points"].as_array())
        path.push_back(vec3(&point));
    const auto last = static_cast<std::size_t>(std::lround(along * static_cast<double>(path.size() - 1)));
    frame.shaft.centreline.assign(
        path.begin(), path.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(last, 1) + 1));
    const Eigen::Vector3d tip = to_eigen(path[last]);
    const Eigen::Vector3d ahead =
        (to_eigen(path[std::min(last + 1, path.size() - 1)]) - to_eigen(path[last > 0 ? last - 1 : 0]))
            .normalized();
    frame.tip = look_at(path[last], to_plain(tip + ahead), {0, -1, 0.02});
    const toml::node_view site = anatomy["landmark"]["viscerotomy"];
    RingMarker ring;
    ring.centre = vec3(site["position"].node());
    ring.rotation = look_at({0, 0, 0}, vec3(site["normal"].node()), {0, 0, 1}).rotation;
    ring.radius = site["ring_diameter"].value_or(0.018) / 2;
    frame.rings.push_back(ring);
    frame.paths.push_back({path});
    const Eigen::Vector3d centre = box.center();
    const double distance = 1.75 * box.sizes().maxCoeff();
    const Eigen::Vector3d eye =
        centre + distance * Eigen::Vector3d(std::sin(bearing), -std::cos(bearing), 0.12);
    frame.external.pose = look_at(to_plain(eye), to_plain(centre), {0, 0, 1});
    frame.cut = CutPlane{to_plain(Eigen::Vector3d(0, -0.06, 0)), {0, -1, 0}};
    frame.endoscope_text = {"Navigation", "Find the red ring and pass through it"};
    frame.external_text = {"External view"};
    Image image;
    renderer.draw(frame);
    std::vector<double> ms(9);
    for (double& m : ms) { // processor time of all threads: steadier than the clock on the wall
        frame.time += 1.0 / 30;
        const std::clock_t start = std::clock();
        renderer.draw(frame);
        renderer.read(image);
        m = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    }
    write_png(argv[2], image);
    std::printf("%s: exposure %.3f, %.1f ms of processor time at best, %s\n", argv[2], renderer.exposure(),
                *std::min_element(ms.begin(), ms.end()), describe_context().c_str());
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "calot_anatomy_picture: %s\n", error.what());
        return 2;
    }
}
