// New arrays, without the cost of new ones. A small one that nobody but a pool still holds is handed out again; the memory of
// large ones is kept when they are gone, as the C library would give it back to the system and fetch it anew, page by page.
#pragma once

#define PY_SSIZE_T_CLEAN
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace vedette {

constexpr int kMostPooledDims = 4;
constexpr npy_intp kMostPooled = 128, kLeastKept = 2048;  // numbers

// Arrays of one shape. A slot's array is free while its one reference is the pool's: then no name, view or buffer of it
// exists, and its list of weak ones must be empty. What Python can change in place (shape, type, flags, memory) is looked at again.
class ArrayPool {
  public:
    bool holds(int dims, const npy_intp* shape) const {
        if (dims != dims_) return false;
        for (int d = 0; d < dims; ++d)
            if (shape[d] != shape_[d]) return false;
        return true;
    }

    void reset(int dims, const npy_intp* shape) {
        dims_ = dims;
        for (int d = 0; d < dims; ++d) shape_[d] = shape[d];
        for (PyArrayObject*& slot : slots_) Py_CLEAR(slot);
    }

    // The first that is free, as it was used last and still lies in the cache; a new one takes the place of one in use.
    PyObject* take() {
        for (PyArrayObject* array : slots_)
            if (array != nullptr && is_free(array)) {
                Py_INCREF(array);
                return reinterpret_cast<PyObject*>(array);
            }
        PyObject* array = PyArray_SimpleNew(dims_, shape_, NPY_DOUBLE);
        if (array == nullptr) return nullptr;
        next_ = (next_ + 1) % kSlots;
        Py_INCREF(array);
        Py_XSETREF(slots_[next_], reinterpret_cast<PyArrayObject*>(array));
        return array;
    }

  private:
    static constexpr int kSlots = 8;
    static constexpr int kFlags =
        NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_OWNDATA | NPY_ARRAY_ALIGNED | NPY_ARRAY_WRITEABLE;
    int dims_ = -1;
    unsigned next_ = 0;
    npy_intp shape_[kMostPooledDims] = {};
    PyArrayObject* slots_[kSlots] = {};

    bool is_free(PyArrayObject* given) const {
        if (Py_REFCNT(given) != 1) return false;
        static PyArray_Descr* const doubles = PyArray_DescrFromType(NPY_DOUBLE);
        const auto* array = reinterpret_cast<const PyArrayObject_fields*>(given);
        return array->weakreflist == nullptr && (array->flags & kFlags) == kFlags && array->descr == doubles &&
               array->base == nullptr && holds(array->nd, array->dimensions);
    }
};

// numpy's allocator for large arrays: blocks of a few sizes, four to a power of two. Those that are gone are kept, up to 64 MB or
// twice what is in use.
class BlockCache {
  public:
    static void* allocate(void*, std::size_t size) {
        const int size_class = class_of(size);
        if (size_class == kClasses) return nullptr;
        Block* block = free_[size_class];
        if (block != nullptr) {
            free_[size_class] = block->next;
            kept_ -= size_of(size_class);
        } else {
            block = static_cast<Block*>(::operator new(kHead + size_of(size_class), std::align_val_t{kHead}, std::nothrow));
            if (block == nullptr) return nullptr;
            want_huge_pages(block, kHead + size_of(size_class));
        }
        block->size_class = size_class;
        used_ += size_of(size_class);
        return reinterpret_cast<char*>(block) + kHead;
    }

    static void release(void*, void* memory, std::size_t) {
        if (memory == nullptr) return;
        auto* block = reinterpret_cast<Block*>(static_cast<char*>(memory) - kHead);
        const std::size_t size = size_of(block->size_class);
        used_ -= size;
        kept_ += size;
        block->next = free_[block->size_class];
        free_[block->size_class] = block;
        const std::size_t most = 2 * used_ > kMostKept ? 2 * used_ : kMostKept;
        for (int size_class = kClasses - 1; kept_ > most; --size_class)  // the largest first: they are the fewest
            while (free_[size_class] != nullptr && kept_ > most) {
                Block* gone = free_[size_class];
                free_[size_class] = gone->next;
                kept_ -= size_of(size_class);
                ::operator delete(gone, std::align_val_t{kHead});
            }
    }

    static void* allocate_zeros(void* context, std::size_t count, std::size_t each) {
        void* memory = allocate(context, count * each);
        return memory == nullptr ? nullptr : std::memset(memory, 0, count * each);
    }

    static void* reallocate(void* context, void* memory, std::size_t size) {
        void* other = allocate(context, size);
        if (other == nullptr || memory == nullptr) return other;
        const auto* block = reinterpret_cast<const Block*>(static_cast<const char*>(memory) - kHead);
        const std::size_t old = size_of(block->size_class);
        std::memcpy(other, memory, old < size ? old : size);
        release(context, memory, 0);
        return other;
    }

  private:
    struct Block {
        int size_class;
        Block* next;
    };
    static constexpr std::size_t kHead = 64, kLeast = 4096, kMostKept = std::size_t(64) << 20, kHuge = std::size_t(4) << 20;
    static constexpr int kClasses = 4 * 40;
    static inline Block* free_[kClasses] = {};
    static inline std::size_t kept_ = 0, used_ = 0;

    static std::size_t size_of(int size_class) {
        return (kLeast << (size_class / 4)) / 4 * static_cast<std::size_t>(4 + size_class % 4);
    }
    static int class_of(std::size_t size) {
        int size_class = 0;
        while (size_class + 4 < kClasses && size_of(size_class + 4) <= size) size_class += 4;
        while (size_class < kClasses && size_of(size_class) < size) ++size_class;
        return size_class;
    }

    // As numpy does for its own.
    static void want_huge_pages([[maybe_unused]] void* block, [[maybe_unused]] std::size_t size) {
#ifdef __linux__
        if (size < kHuge) return;
        const std::size_t skipped = 4096 - reinterpret_cast<std::uintptr_t>(block) % 4096;
        madvise(static_cast<char*>(block) + skipped, size - skipped, MADV_HUGEPAGE);
#endif
    }
};

// Where a program has set an allocator of its own, that one serves.
inline PyObject* new_large_array(int dims, npy_intp* shape) {
    static PyDataMem_Handler handler = {
        "vedette", 1, {nullptr, BlockCache::allocate, BlockCache::allocate_zeros, BlockCache::reallocate, BlockCache::release}};
    static PyObject* const own = PyCapsule_New(&handler, "mem_handler", nullptr);
    PyObject* usual = PyDataMem_GetHandler();
    if (usual == nullptr) return nullptr;
    const bool ours = own != nullptr && usual == PyDataMem_DefaultHandler;
    PyObject* before = ours ? PyDataMem_SetHandler(own) : nullptr;
    PyObject* array = ours && before == nullptr ? nullptr : PyArray_SimpleNew(dims, shape, NPY_DOUBLE);
    PyObject* after = before == nullptr ? nullptr : PyDataMem_SetHandler(usual);
    if (before != nullptr && after == nullptr) Py_CLEAR(array);
    Py_XDECREF(before), Py_XDECREF(after), Py_DECREF(usual);
    return array;
}

// An uninitialised array of doubles. The interpreter's lock guards pools and blocks.
inline PyObject* new_array(int dims, npy_intp* shape) {
    static ArrayPool pools[256];
    npy_intp size = 1;
    std::uint32_t hash = static_cast<std::uint32_t>(dims);
    for (int d = 0; d < dims; ++d) {
        size *= shape[d];
        hash = hash * 31 + static_cast<std::uint32_t>(shape[d]);
    }
    if (size >= kLeastKept) return new_large_array(dims, shape);
    if (dims > kMostPooledDims || size > kMostPooled) return PyArray_SimpleNew(dims, shape, NPY_DOUBLE);
    ArrayPool& pool = pools[(hash ^ (hash >> 8)) % 256];
    if (!pool.holds(dims, shape)) pool.reset(dims, shape);
    if (!pool.holds(dims, shape)) return PyArray_SimpleNew(dims, shape, NPY_DOUBLE);  // a callback was quicker
    return pool.take();
}

}  // namespace vedette
