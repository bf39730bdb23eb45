#include "rendering/gl_objects.hpp"

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace calot::rendering {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read; is the installation complete?");
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

std::string expand_includes(const fs::path& folder, const std::string& text) {
    std::istringstream in(text);
    std::string out, line;
    constexpr std::string_view kInclude = "#include \"";
    while (std::getline(in, line)) {
        if (line.starts_with(kInclude)) {
            const std::string name =
                line.substr(kInclude.size(), line.find('"', kInclude.size()) - kInclude.size());
            out += read_text(folder / fs::path(name).filename());
        } else {
            out += line;
        }
        out += '\n';
    }
    return out;
}

GLuint compile(GLenum kind, const fs::path& folder, const std::string& file,
               const std::vector<std::string>& defines) {
    std::string source = "#version 330 core\n";
    for (const std::string& define : defines)
        source += "#define " + define + "\n";
    source += expand_includes(folder, read_text(folder / file));
    const GLuint shader = glCreateShader(kind);
    const char* text = source.c_str();
    glShaderSource(shader, 1, &text, nullptr);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        std::array<char, 4096> log{};
        glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
        glDeleteShader(shader);
        throw std::runtime_error((folder / file).string() + ": does not compile: " + log.data());
    }
    return shader;
}

} // namespace

Buffer make_buffer() {
    GLuint n = 0;
    glGenBuffers(1, &n);
    return Buffer(n);
}
VertexArray make_vertex_array() {
    GLuint n = 0;
    glGenVertexArrays(1, &n);
    return VertexArray(n);
}
Texture make_texture() {
    GLuint n = 0;
    glGenTextures(1, &n);
    return Texture(n);
}
Renderbuffer make_renderbuffer() {
    GLuint n = 0;
    glGenRenderbuffers(1, &n);
    return Renderbuffer(n);
}
Framebuffer make_framebuffer() {
    GLuint n = 0;
    glGenFramebuffers(1, &n);
    return Framebuffer(n);
}

Program::Program(const fs::path& folder, const std::string& vertex, const std::string& geometry,
                 const std::string& fragment, const std::vector<std::string>& defines) {
    std::vector<GLuint> shaders;
    const auto drop = [&] {
        for (GLuint s : shaders)
            glDeleteShader(s);
    };
    try {
        shaders.push_back(compile(GL_VERTEX_SHADER, folder, vertex, defines));
        if (!geometry.empty()) shaders.push_back(compile(GL_GEOMETRY_SHADER, folder, geometry, defines));
        shaders.push_back(compile(GL_FRAGMENT_SHADER, folder, fragment, defines));
    } catch (...) {
        drop();
        throw;
    }
    name_ = GlName<detail::free_program>(glCreateProgram());
    for (GLuint s : shaders)
        glAttachShader(*name_, s);
    glLinkProgram(*name_);
    drop();
    GLint ok = 0;
    glGetProgramiv(*name_, GL_LINK_STATUS, &ok);
    if (!ok) {
        std::array<char, 4096> log{};
        glGetProgramInfoLog(*name_, static_cast<GLsizei>(log.size()), nullptr, log.data());
        throw std::runtime_error((folder / vertex).string() + " with " + fragment +
                                 ": does not link: " + log.data());
    }
}

GLint Program::uniform(const char* name) const {
    const auto found = uniforms_.find(name);
    if (found != uniforms_.end()) return found->second;
    const GLint place = glGetUniformLocation(*name_, name);
    uniforms_.emplace(name, place);
    return place;
}

std::string describe_context() {
    const auto text = [](GLenum name) {
        const auto* s = reinterpret_cast<const char*>(glGetString(name));
        return std::string(s ? s : "?");
    };
    return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

bool draws_on_processor() {
    const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string_view renderer(name ? name : "");
    for (const char* one : {"llvmpipe", "softpipe", "swrast"})
        if (renderer.find(one) != std::string_view::npos) return true;
    return false;
}

fs::path find_shaders(const fs::path& given) {
    std::vector<fs::path> places;
    if (!given.empty()) {
        places.push_back(given);
    } else {
        if (const char* assets = std::getenv("CALOT_ASSETS")) places.push_back(fs::path(assets) / "shaders");
        std::error_code error;
        const fs::path program = fs::read_symlink("/proc/self/exe", error);
        for (fs::path folder = program.parent_path(); !folder.empty() && folder != folder.root_path();
             folder = folder.parent_path()) {
            places.push_back(folder / "assets/shaders");
            places.push_back(folder / "share/calot/shaders");
        }
    }
    std::string looked;
    for (const fs::path& place : places) {
        std::error_code error;
        if (fs::exists(place / "appearance.toml", error)) return place;
        looked += "\n  " + place.string();
    }
    throw std::runtime_error("the shaders (appearance.toml) are in none of these folders; set CALOT_ASSETS:" +
                             looked);
}

} // namespace calot::rendering
