#include "classifier/base/parallel.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace weft::classifier {
namespace {

std::size_t thread_count(std::size_t count, std::size_t requested) {
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  return std::clamp<std::size_t>(requested == 0 ? cores : requested, 1,
                                 std::max<std::size_t>(1, count));
}

// Keeps the first exception of any thread until all threads have ended.
class FirstThrown {
 public:
  void on_error() noexcept {
    const std::lock_guard lock(mutex_);
    if (!thrown_) thrown_ = std::current_exception();
  }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr thrown_;
};

// Runs `body(t)` on threads t = 0 .. n - 1; thread 0 is the caller's own.
void on_threads(std::size_t n, const std::function<void(std::size_t)>& body) {
  FirstThrown first;
  const auto guarded = [&](std::size_t t) {
    try {
      body(t);
    } catch (...) {
      first.on_error();
    }
  };
  {
    std::vector<std::jthread> others;
    others.reserve(n - 1);
    for (std::size_t t = 1; t < n; ++t) others.emplace_back([&guarded, t] { guarded(t); });
    guarded(0);
  }
  first.rethrow();
}

constexpr double bytes_of_a_number = 8.0;

double gigabytes(std::size_t rows, double matrices) {
  return matrices * bytes_of_a_number * std::pow(static_cast<double>(rows), 2) / 1e9;
}

std::string format_gb(double gb) {
  std::string out = std::to_string(gb);
  out.resize(out.find('.') + 2);
  return out + " GB";
}

}  // namespace

void parallel_for(std::size_t count, std::size_t threads,
                  const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  on_threads(thread_count(count, threads), [&](std::size_t) {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  });
}

void parallel_workers(std::size_t count, std::size_t threads,
                      const std::function<std::function<void(std::size_t)>()>& make_worker) {
  std::atomic<std::size_t> next{0};
  on_threads(thread_count(count, threads), [&](std::size_t) {
    const auto work = make_worker();
    for (std::size_t i = next++; i < count; i = next++) work(i);
  });
}

void parallel_blocks(std::size_t count, std::size_t threads,
                     const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t n = thread_count(count, threads);
  on_threads(n, [&](std::size_t t) { work(count * t / n, count * (t + 1) / n); });
}

tl::unexpected<Error> out_of_memory(std::size_t rows, const std::string& got) {
  return fail({.code = Errc::range,
               .where = std::to_string(rows) + " feature vectors",
               .what = "too many feature vectors for the memory of this computer",
               .expected = format_gb(gigabytes(rows, 1.0)) + " for each distance matrix",
               .got = got,
               .hint = "Use longer windows, less overlap or --learner lda"});
}

Status check_square_memory(std::size_t rows, double matrices) {
  const double whole_gb = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                          static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e9;
  const double needed_gb = gigabytes(rows, matrices);
  if (whole_gb <= 0.0 || needed_gb <= whole_gb) return {};
  return out_of_memory(rows, format_gb(needed_gb) + " needed of " + format_gb(whole_gb));
}

}  // namespace weft::classifier
