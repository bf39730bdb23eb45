// Draws an anatomy (assets/anatomy/*/anatomy.toml) with an endoscope pushed along its path, for looking at:
//   calot_anatomy_picture ANATOMY.toml PICTURE.png --along 0.8
#include "rendering/egl_context.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/linear.hpp"
#include "rendering/mesh_surface.hpp"
#include "rendering/orbit_camera.hpp"
#include "rendering/png.hpp"
#include "rendering/renderer.hpp"

#include <calot/meshio/read.hpp>

#include <CLI/CLI.hpp>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <stdexcept>

namespace {

using namespace calot::rendering;

struct Options {
    std::filesystem::path anatomy, picture;
    double along = 0.6, bearing = 20, elevation = 8, distance = 0, cut_depth = -0.06;
    std::vector<double> eye, look, centre;
    std::string style = "veil";
    std::vector<std::string> hide;
    RendererSettings settings;
    bool external = true;
};

Vec3 vec3(const toml::node* node) {
    const toml::array* a = node ? node->as_array() : nullptr;
    if (!a || a->size() != 3) throw std::runtime_error("anatomy: a place must be three numbers");
    return {a->get(0)->value_or(0.0), a->get(1)->value_or(0.0), a->get(2)->value_or(0.0)};
}

Vec3 vec3(const std::vector<double>& v) {
    return {v[0], v[1], v[2]};
}

bool has_look(const toml::table& organ, const std::string& prefix) {
    const toml::table* regions = organ["appearance"].as_table();
    if (!regions) return organ["appearance"].value_or(std::string()).starts_with(prefix);
    return std::any_of(regions->begin(), regions->end(), [&](const auto& region) {
        return region.second.value_or(std::string()).starts_with(prefix);
    });
}

Style style_of(const toml::table& organ, const Options& options) {
    const std::string id = organ["id"].value_or(std::string());
    if (std::find(options.hide.begin(), options.hide.end(), id) != options.hide.end()) return Style::Hidden;
    if (has_look(organ, "skin")) return Style::Outline; // the body's wall
    if (options.style == "solid") return Style::Solid;
    if (options.style == "cut") return Style::Cut;
    return has_look(organ, "mucosa") || has_look(organ, "ligament") ? Style::Translucent : Style::Solid;
}

void add_organs(const toml::table& anatomy, const Options& options, Renderer& renderer, FrameState& frame,
                Eigen::AlignedBox3d& box) {
    const toml::array* organs = anatomy["organ"].as_array();
    if (!organs) throw std::runtime_error(options.anatomy.string() + ": has no [[organ]]");
    for (const toml::node& node : *organs) {
        const toml::table& organ = *node.as_table();
        const auto mesh =
            calot::meshio::read_mesh(options.anatomy.parent_path() / organ["mesh"].value_or(std::string()));
        const toml::table* looks = organ["appearance"].as_table();
        const std::string whole = organ["appearance"].value_or(std::string("serosa"));
        const SurfaceId id = renderer.add(to_surface(mesh, [&](const std::string& region) {
            return looks ? (*looks)[region].value_or(std::string("serosa")) : whole;
        }));
        const Style style = style_of(organ, options);
        frame.surfaces.push_back({id, style, {}});
        if (style == Style::Outline || style == Style::Hidden) continue;
        for (const auto& v : mesh.vertices)
            box.extend(Eigen::Vector3d(v[0], v[1], v[2]));
    }
}

void draw(const Options& options) {
    const toml::table anatomy = toml::parse_file(options.anatomy.string());
    limit_software_threads();
    EglContext context;
    Renderer renderer(options.settings);
    FrameState frame;
    Eigen::AlignedBox3d box;
    add_organs(anatomy, options, renderer, frame, box);

    std::vector<Vec3> path;
    if (const toml::array* points = anatomy["landmark"]["path"]["points"].as_array())
        for (const toml::node& point : *points)
            path.push_back(vec3(&point));
    if (path.size() < 2)
        throw std::runtime_error(options.anatomy.string() +
                                 ": landmark.path.points: needs two points or more");
    const auto last =
        static_cast<std::size_t>(std::lround(options.along * static_cast<double>(path.size() - 1)));
    frame.shaft.centreline.assign(
        path.begin(), path.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(last, 1) + 1));
    const Eigen::Vector3d tip = to_eigen(path[last]);
    const Eigen::Vector3d ahead =
        to_eigen(path[std::min(last + 1, path.size() - 1)]) - to_eigen(path[last > 0 ? last - 1 : 0]);
    frame.tip = look_at(path[last], to_plain(tip + ahead.normalized()), {0, -1, 0.02});
    if (options.eye.size() == 3 && options.look.size() == 3) {
        frame.tip = look_at(vec3(options.eye), vec3(options.look), {0, -1, 0.02});
        const Eigen::Vector3d forward = to_matrix(frame.tip.rotation).col(2);
        for (const double behind : {0.05, 0.03, 0.01, 0.0})
            frame.shaft.centreline.push_back(to_plain(to_eigen(vec3(options.eye)) - behind * forward));
    }
    const toml::node_view site = anatomy["landmark"]["viscerotomy"];
    if (site.is_table()) {
        RingMarker ring;
        ring.centre = vec3(site["position"].node());
        ring.rotation = look_at({0, 0, 0}, vec3(site["normal"].node()), {0, 0, 1}).rotation;
        ring.radius = site["ring_diameter"].value_or(0.018) / 2;
        frame.rings.push_back(ring);
    }
    frame.paths.push_back({path});
    const double degree = std::numbers::pi / 180;
    const Vec3 centre =
        options.centre.size() == 3 ? vec3(options.centre) : to_plain(Eigen::Vector3d(box.center()));
    const double distance = options.distance > 0 ? options.distance : 1.75 * box.sizes().maxCoeff();
    frame.external.on = options.external;
    frame.external.pose =
        OrbitCamera(centre, distance, options.bearing * degree, options.elevation * degree).pose();
    frame.cut = CutPlane{{0, options.cut_depth, 0}, {0, -1, 0}};
    frame.endoscope_text = {"Navigation", "Find the red ring and pass through it"};
    frame.external_text = {"External view"};

    Image image;
    renderer.draw(frame);
    std::vector<double> ms(5);
    for (double& m : ms) { // processor time of all threads: steadier than the clock on the wall
        frame.time += 1.0 / 30;
        const std::clock_t start = std::clock();
        renderer.draw(frame);
        renderer.read(image);
        m = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    }
    write_png(options.picture, image);
    std::printf("%s: exposure %.3f, %.1f ms of processor time at best, %s\n", options.picture.c_str(),
                renderer.exposure(), *std::min_element(ms.begin(), ms.end()), describe_context().c_str());
}

int perform(int argc, char** argv) {
    Options o;
    o.settings.scale = 1;
    CLI::App app("Draws an anatomy with an endoscope in it.");
    app.add_option("anatomy", o.anatomy, "anatomy.toml")->required();
    app.add_option("picture", o.picture, "PNG file to write")->required();
    app.add_option("--along", o.along, "how far along the path the tip is, 0..1")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--eye", o.eye, "instead: where the lens is, x y z in m")->expected(3);
    app.add_option("--look", o.look, "and what it looks at")->expected(3);
    app.add_option("--style", o.style, "of walls in the external view")
        ->check(CLI::IsMember({"solid", "veil", "cut"}));
    app.add_option("--hide", o.hide, "organs left out");
    app.add_option("--cut-depth", o.cut_depth, "y of the cut plane, m");
    app.add_option("--bearing", o.bearing, "external view: degrees to the patient's left");
    app.add_option("--elevation", o.elevation, "external view: degrees upwards");
    app.add_option("--distance", o.distance, "external view: m from the centre");
    app.add_option("--centre", o.centre, "external view: what it looks at")->expected(3);
    app.add_option("--width", o.settings.width);
    app.add_option("--height", o.settings.height);
    app.add_option("--samples", o.settings.samples, "1 or 4");
    app.add_flag("!--no-external", o.external, "the endoscope's view alone");
    CLI11_PARSE(app, argc, argv);
    draw(o);
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return perform(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "calot_anatomy_picture: %s\n", error.what());
        return 2;
    }
}
