#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <sys/mman.h>

namespace calot::mesher {

/// Memory whose addresses grow in the order of allocation and start at the same place each time. CGAL's
/// refinement keeps its queues sorted by address where qualities are equal, so its result depends on where
/// memory happens to lie; with this it does not. Not for more than one thread.
class OrderedMemory {
  public:
    static OrderedMemory& instance() {
        static OrderedMemory memory;
        return memory;
    }

    void* allocate(std::size_t bytes) {
        bytes = (bytes + 63) / 64 * 64;
        if (bytes > size - used_) throw std::bad_alloc();
        void* at = base_ + used_;
        used_ += bytes;
        ++live_;
        return at;
    }

    /// Space is taken back when all of it is free.
    void deallocate() {
        if (--live_ == 0) used_ = 0;
    }

  private:
    static constexpr std::size_t size = std::size_t(16) << 30; // reserved; pages are used as they are touched

    OrderedMemory() {
        void* wanted = reinterpret_cast<void*>(0x2000'0000'0000);
        void* at = mmap(wanted, size, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1, 0);
        if (at == MAP_FAILED) // taken (a sanitizer's shadow): order alone remains
            at = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1,
                      0);
        if (at == MAP_FAILED) throw std::bad_alloc();
        base_ = static_cast<std::byte*>(at);
    }

    std::byte* base_ = nullptr;
    std::size_t used_ = 0, live_ = 0;
};

template<class T>
struct OrderedAllocator {
    using value_type = T;
    OrderedAllocator() = default;
    template<class U>
    OrderedAllocator(const OrderedAllocator<U>&) {}
    T* allocate(std::size_t n) { return static_cast<T*>(OrderedMemory::instance().allocate(n * sizeof(T))); }
    void deallocate(T*, std::size_t) { OrderedMemory::instance().deallocate(); }
    template<class U>
    bool operator==(const OrderedAllocator<U>&) const {
        return true;
    }
};

} // namespace calot::mesher
