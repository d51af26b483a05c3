#pragma once
// Reads the settings and calibration pages of a Net F/T box over its HTTP port.

#include <functional>

#include "drivers/api/link.hpp"
#include "protocols/rdt/page.hpp"

namespace weft::drivers {

struct BoxPages {
  protocols::rdt::SettingsPage settings;
  protocols::rdt::CalibrationPage calibration;
};

/// One page after the other on one connection. `done` is called once a read, never from read().
class PageReader {
 public:
  using Done = std::function<void(Result<BoxPages>)>;
  explicit PageReader(Done done) : done_(std::move(done)) {}
  ~PageReader() { let_go(); }
  PageReader(const PageReader&) = delete;
  PageReader& operator=(const PageReader&) = delete;

  /// Errors: io. `link` outlives the reading.
  Status read(Link& link);
  /// No callback comes any more.
  void let_go();
  [[nodiscard]] bool reading() const { return link_ != nullptr; }

 private:
  Status send_request(std::string_view path);
  void received(ByteView bytes);
  void finish(Result<BoxPages> outcome);

  Done done_;
  Link* link_ = nullptr;
  protocols::rdt::HttpReply reply_;
  bool at_calibration_ = false;
  BoxPages pages_;
};

}  // namespace weft::drivers
