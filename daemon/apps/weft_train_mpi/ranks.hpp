#pragma once
// The processes of one MPI job: rank 0 sends orders to all, any rank sends texts to rank 0. Only
// weft-train-mpi includes this; nothing else in Weft depends on MPI.

#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace weft::daemon::cluster {

/// The root's next order to all ranks.
enum class Order : int {
  report,  ///< report whether the data could be read, and their SHA-256
  train,   ///< train a share of the cores of the task in `text`: task_text()
  end
};

/// This process's place in the job. MPI's default error handler ends the whole job, so calls that
/// return have succeeded.
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
  /// From the root to all ranks. Texts of at most 2 GiB.
  static void give(Command command) { broadcast(std::move(command)); }
  /// Waits for the root's next order.
  static Command take() { return broadcast({}); }

  /// Texts of at most 2 GiB.
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
