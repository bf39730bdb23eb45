#include "host/exports.hpp"

#include <cstring>
#include <elf.h>
#include <fstream>
#include <stdexcept>

namespace calot::host {
namespace {

constexpr std::uintmax_t max_library_bytes = 512u << 20;

// Bytes of a file, with every access checked.
class Bytes {
  public:
    explicit Bytes(const std::filesystem::path& file) {
        std::error_code problem;
        if (!std::filesystem::is_regular_file(file, problem)) throw std::runtime_error("is missing");
        if (std::filesystem::file_size(file) > max_library_bytes)
            throw std::runtime_error("is larger than 512 MiB");
        std::ifstream stream(file, std::ios::binary);
        if (!stream) throw std::runtime_error("cannot be opened");
        bytes_.assign(std::istreambuf_iterator<char>(stream), {});
    }
    template<class T>
    T at(std::uint64_t offset) const {
        if (offset > bytes_.size() || bytes_.size() - offset < sizeof(T))
            throw std::runtime_error("is truncated or damaged");
        T value;
        std::memcpy(&value, bytes_.data() + offset, sizeof value);
        return value;
    }
    std::string text(std::uint64_t offset) const {
        if (offset >= bytes_.size()) throw std::runtime_error("is truncated or damaged");
        const std::size_t most = std::min<std::size_t>(bytes_.size() - offset, 4096);
        return {bytes_.data() + offset, strnlen(bytes_.data() + offset, most)};
    }

  private:
    std::vector<char> bytes_;
};

} // namespace

Exports read_exports(const std::filesystem::path& library) {
    const Bytes bytes(library);
    const auto header = bytes.at<Elf64_Ehdr>(0);
    if (std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != ELFCLASS64)
        throw std::runtime_error("is not a 64-bit ELF library");
    const auto section = [&](std::uint64_t index) {
        if (index >= header.e_shnum) throw std::runtime_error("is damaged");
        return bytes.at<Elf64_Shdr>(header.e_shoff + index * sizeof(Elf64_Shdr));
    };
    Exports exports;
    for (std::uint64_t i = 0; i < header.e_shnum; ++i) {
        const Elf64_Shdr table = section(i);
        if (table.sh_type != SHT_DYNSYM) continue;
        const Elf64_Shdr names = section(table.sh_link);
        for (std::uint64_t at = 0; at + sizeof(Elf64_Sym) <= table.sh_size; at += sizeof(Elf64_Sym)) {
            const auto symbol = bytes.at<Elf64_Sym>(table.sh_offset + at);
            const unsigned binding = ELF64_ST_BIND(symbol.st_info);
            const unsigned visibility = ELF64_ST_VISIBILITY(symbol.st_other);
            if (symbol.st_shndx == SHN_UNDEF || binding == STB_LOCAL) continue;
            if (visibility == STV_HIDDEN || visibility == STV_INTERNAL) continue;
            exports.names.push_back(bytes.text(names.sh_offset + symbol.st_name));
            if (binding == STB_GNU_UNIQUE) exports.unique.push_back(exports.names.back());
        }
        return exports;
    }
    throw std::runtime_error("has no table of dynamic symbols");
}

} // namespace calot::host
