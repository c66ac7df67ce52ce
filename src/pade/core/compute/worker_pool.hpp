// A few threads that work on strips of an image. The strips' results do not depend on how many there are.
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace pade::flow {

/// `threads` - 1 helpers beside the calling thread. One pair of images is some hundred short rounds of work,
/// so a thread that waits for the next one spins briefly before it blocks.
class WorkerPool {
 public:
  explicit WorkerPool(int threads) {
    for (int i = 1; i < threads; ++i) helpers_.emplace_back([this, i] { serve(i); });
  }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool() {
    work_ = nullptr;
    announce();
    for (std::thread& helper : helpers_) helper.join();
  }

  [[nodiscard]] int size() const { return static_cast<int>(helpers_.size()) + 1; }

  /// Calls work(0) to work(size() - 1), one on each thread, and waits for all.
  void run(const std::function<void(int)>& work) {
    if (helpers_.empty()) return work(0);
    work_ = &work;
    pending_.store(static_cast<int>(helpers_.size()), std::memory_order_relaxed);
    announce();
    const Wait wait{*this};  // also if work(0) throws: until they are done, the helpers use `work`
    work(0);
  }

 private:
  struct Wait {
    WorkerPool& pool;
    ~Wait() {
      const std::atomic<int>& pending = pool.pending_;
      for (int left = pending.load(std::memory_order_acquire); left != 0;) left = after(pending, left);
    }
  };

  void announce() {
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
  }

  // Waits until the value is another than `old`, and returns it.
  static int after(const std::atomic<int>& value, int old) {
    constexpr int kLooks = 4000;  // some tens of microseconds
    for (int i = 0; i < kLooks; ++i) {
      const int now = value.load(std::memory_order_acquire);
      if (now != old) return now;
#if defined(__x86_64__)
      __builtin_ia32_pause();
#elif defined(__aarch64__)
      __asm__ volatile("isb");  // waits some cycles; `yield` does nothing on most of its processors
#endif
    }
    value.wait(old, std::memory_order_acquire);
    return value.load(std::memory_order_acquire);
  }

  void serve(int index) {
    for (int seen = 0;;) {
      seen = after(round_, seen);
      if (work_ == nullptr) return;
      (*work_)(index);
      if (pending_.fetch_sub(1, std::memory_order_acq_rel) == 1) pending_.notify_one();
    }
  }

  std::vector<std::thread> helpers_;
  const std::function<void(int)>* work_ = nullptr;  // written before round_, read after it
  std::atomic<int> round_{0};
  std::atomic<int> pending_{0};
};

}  // namespace pade::flow
