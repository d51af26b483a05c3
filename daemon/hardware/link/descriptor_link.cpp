#include "daemon/hardware/link/descriptor_link.hpp"

#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <deque>
#include <system_error>
#include <utility>

namespace weft::daemon {
namespace {

constexpr std::size_t read_bytes = 65536;  // the largest datagram

}  // namespace

// Handlers hold it weakly except while they run: their callbacks may destroy the link.
struct DescriptorLink::Port : std::enable_shared_from_this<Port> {
  Port(RealLoop& on, int fd, Framing how, std::string what, Unsent rest)
      : loop(&on), name(std::move(what)), framing(how), unsent(rest), descriptor(on.ports(), fd) {
    asio::error_code ignored;
    descriptor.non_blocking(true, ignored);
  }

  void read() {
    descriptor.async_read_some(
        asio::buffer(incoming),
        [weak = weak_from_this()](const asio::error_code& error, std::size_t count) {
          if (const auto self = weak.lock()) self->have_read(error, count);
        });
  }

  void have_read(const asio::error_code& error, std::size_t count) {
    if (gone || error == asio::error::operation_aborted) return;
    if (framing == Framing::terminals && error.value() == EIO) {
      paused = true;
      if (vacant) vacant();
      return;
    }
    if (error && !harmless(error)) {
      if (error == asio::error::eof) let_read_to_the_end();
      return close(error.message());
    }
    if (receiver && !held && error != asio::error::connection_refused)
      receiver(ByteView(incoming.data(), count), loop->now());
    if (!gone) read();
  }

  // For datagrams "end of file" is an empty one, and "refused" means that the far end does not
  // listen yet.
  [[nodiscard]] bool harmless(const asio::error_code& error) const {
    return framing == Framing::datagrams &&
           (error == asio::error::eof || error == asio::error::connection_refused);
  }

  /// A far end that has stopped sending may still read the last bytes. So the socket is not reset,
  /// even if it was set to simulate a pulled plug.
  void let_read_to_the_end() {
    const linger tidily{0, 0};
    ::setsockopt(descriptor.native_handle(), SOL_SOCKET, SO_LINGER, &tidily, sizeof tidily);
  }

  void close(const std::string& why) {
    gone = true;
    asio::error_code ignored;
    descriptor.close(ignored);
    if (const Link::Closed callback = std::exchange(closed, {}))
      callback(Error{.code = Errc::io,
                     .where = name,
                     .what = "port closed",
                     .got = why,
                     .hint = "Check that the device is on and connected"});
  }

  Status send(ByteView bytes) {
    if (gone) return fail({.code = Errc::io, .where = name, .what = "port already closed"});
    if (unsent == Unsent::lost && !waiting.empty()) return {};
    if (!held && waiting.empty()) {
      const Result<std::size_t> taken = put(bytes);
      if (!taken) return pass(taken.error());
      bytes = bytes.subspan(*taken);
      if (bytes.empty() || (unsent == Unsent::lost && *taken == 0)) return {};
    }
    if (waiting_bytes + bytes.size() > most_waiting)
      return fail({.code = Errc::io,
                   .where = name,
                   .what = "device does not accept data",
                   .expected = "at most " + std::to_string(most_waiting) + " bytes unsent",
                   .hint = "Check that flow control (RTS/CTS) is wired and set on both sides"});
    waiting.emplace_back(bytes.begin(), bytes.end());
    waiting_bytes += bytes.size();
    if (!held && waiting.size() == 1) write_when_ready();
    return {};
  }

  // Number of bytes that the port accepted at once.
  Result<std::size_t> put(ByteView bytes) {
    const ssize_t count = ::write(descriptor.native_handle(), bytes.data(), bytes.size());
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno == EAGAIN || errno == EINTR) return 0U;
    if (framing == Framing::datagrams && (errno == ECONNREFUSED || errno == ENETUNREACH))
      return bytes.size();
    return fail({.code = Errc::io,
                 .where = name,
                 .what = "write to the port failed",
                 .got = std::generic_category().message(errno)});
  }

  void write_when_ready() {
    descriptor.async_wait(asio::posix::stream_descriptor::wait_write,
                          [weak = weak_from_this()](const asio::error_code& error) {
                            if (const auto self = weak.lock(); self && !error)
                              self->write_waiting();
                          });
  }

  void write_waiting() {
    while (!gone && !waiting.empty()) {
      Bytes& first = waiting.front();
      const Result<std::size_t> taken = put(first);
      if (!taken) return close(taken.error().got);
      waiting_bytes -= *taken;
      if (*taken < first.size()) {
        first.erase(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(*taken));
        return write_when_ready();
      }
      waiting.pop_front();
    }
  }

  void purge() {
    if (!gone) ::tcflush(descriptor.native_handle(), TCIOFLUSH);
  }
  void release() {
    held = false;
    if (!gone && !waiting.empty()) write_when_ready();
  }

  RealLoop* loop;
  std::string name;
  Framing framing;
  Unsent unsent;
  asio::posix::stream_descriptor descriptor;
  std::array<std::uint8_t, read_bytes> incoming{};
  std::deque<Bytes> waiting;
  std::size_t waiting_bytes = 0;
  bool held = false;
  bool gone = false;
  bool paused = false;
  Link::Receiver receiver;
  Link::Closed closed;
  std::function<void()> vacant;
};

DescriptorLink::DescriptorLink(RealLoop& loop, int descriptor, Framing framing, std::string name,
                               Unsent unsent)
    : port_(std::make_shared<Port>(loop, descriptor, framing, std::move(name), unsent)) {
  port_->read();
}

DescriptorLink::~DescriptorLink() {
  port_->receiver = {};
  port_->closed = {};
  port_->vacant = {};
  if (!port_->gone) port_->close({});
}

Status DescriptorLink::write(ByteView bytes) {
  return port_->send(bytes);
}

void DescriptorLink::on_receive(Receiver receiver) {
  port_->receiver = std::move(receiver);
}

void DescriptorLink::on_closed(Closed closed) {
  port_->closed = std::move(closed);
}

void DescriptorLink::forget_unsent() {
  port_->waiting.clear();
  port_->waiting_bytes = 0;
}

void DescriptorLink::on_vacant(std::function<void()> vacant) {
  port_->vacant = std::move(vacant);
}

void DescriptorLink::resume() {
  if (!port_->gone && std::exchange(port_->paused, false)) port_->read();
}

void DescriptorLink::hold_for(Duration delay) {
  port_->held = true;
  port_->loop->after(delay / 2, [weak = std::weak_ptr(port_)] {
    if (const auto port = weak.lock()) port->purge();
  });
  port_->loop->after(delay, [weak = std::weak_ptr(port_)] {
    if (const auto port = weak.lock()) port->release();
  });
}

}  // namespace weft::daemon
