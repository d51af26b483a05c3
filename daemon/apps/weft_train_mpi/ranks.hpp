#pragma once
// The processes of one MPI job: orders from the first to all, texts from any to the first. Included
// by weft-train-mpi only: nothing else of Weft knows MPI.

#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace weft::daemon::cluster {

/// What the root tells everybody to do next.
enum class Order : int {
  report,  ///< say whether the data could be read, and their SHA-256
  train,   ///< a share of the cores of the task that `text` is: task_text()
  end
};

/// This process' place in the job. MPI's default error handler ends the whole job, so calls that
/// return have worked.
class Ranks {
 public:
  Ranks() {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  ~Ranks() { MPI_Finalize(); }

  [[nodiscard]] bool root() const { return rank_ == 0; }
  [[nodiscard]] std::size_t rank() const { return static_cast<std::size_t>(rank_); }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(size_); }

  struct Command {
    Order order = Order::end;
    std::string text = {};
  };
  /// Of the root to all. Texts of at most 2 GiB.
  static void give(Command command) { broadcast(std::move(command)); }
  /// Waits for the root's next.
  static Command take() { return broadcast({}); }

  /// At most 2 GiB.
  static void send_to_root(std::string_view text) {
    MPI_Send(text.data(), static_cast<int>(text.size()), MPI_CHAR, 0, text_tag, MPI_COMM_WORLD);
  }
  static std::string receive_from(std::size_t rank) {
    MPI_Status status;
    const int source = static_cast<int>(rank);
    MPI_Probe(source, text_tag, MPI_COMM_WORLD, &status);
    int bytes = 0;
    MPI_Get_count(&status, MPI_CHAR, &bytes);
    std::string text(static_cast<std::size_t>(bytes), '\0');
    MPI_Recv(text.data(), bytes, MPI_CHAR, source, text_tag, MPI_COMM_WORLD, &status);
    return text;
  }

 private:
  static constexpr int text_tag = 1;

  static Command broadcast(Command command) {
    int head[2]{static_cast<int>(command.order), static_cast<int>(command.text.size())};
    MPI_Bcast(head, 2, MPI_INT, 0, MPI_COMM_WORLD);
    command.order = static_cast<Order>(head[0]);
    command.text.resize(static_cast<std::size_t>(head[1]));
    MPI_Bcast(command.text.data(), head[1], MPI_CHAR, 0, MPI_COMM_WORLD);
    return command;
  }

  int rank_ = 0;
  int size_ = 1;
};

}  // namespace weft::daemon::cluster
