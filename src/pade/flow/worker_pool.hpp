// A few threads that work on strips of an image. The strips' results do not depend on how many there are.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace pade::flow {

/// `threads` - 1 helpers beside the calling thread; they sleep between calls.
class WorkerPool {
 public:
  explicit WorkerPool(int threads) {
    for (int i = 1; i < threads; ++i) helpers_.emplace_back([this, i] { serve(i); });
  }
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& helper : helpers_) helper.join();
  }

  [[nodiscard]] int size() const { return static_cast<int>(helpers_.size()) + 1; }

  /// Calls work(0) to work(size() - 1), one on each thread, and waits for all.
  void run(const std::function<void(int)>& work) {
    if (helpers_.empty()) return work(0);
    {
      const std::lock_guard lock(mutex_);
      work_ = &work;
      pending_ = static_cast<int>(helpers_.size());
      ++round_;
    }
    wake_.notify_all();
    work(0);
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return pending_ == 0; });
  }

 private:
  void serve(int index) {
    long seen = 0;
    for (;;) {
      const std::function<void(int)>* work = nullptr;
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return stop_ || round_ != seen; });
        if (stop_) return;
        seen = round_;
        work = work_;
      }
      (*work)(index);
      {
        const std::lock_guard lock(mutex_);
        --pending_;
      }
      done_.notify_one();
    }
  }

  std::vector<std::thread> helpers_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable done_;
  const std::function<void(int)>* work_ = nullptr;
  int pending_ = 0;
  long round_ = 0;
  bool stop_ = false;
};

}  // namespace pade::flow
