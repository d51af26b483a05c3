#pragma once
// Errors are values. A Result holds a value or an Error with the place, the expected and the found
// value, and a hint. Callers add context while unwinding.

#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace weft {

/// Causes of a failure, one per reaction of a program or a person: see error_codes() and
/// docs/reference/errors.md. Numbers are part of exported files and of the drivers' C ABI: never
/// renumber.
enum class Errc {
  invalid_argument = 1,
  parse = 2,
  checksum = 3,
  range = 4,
  not_found = 5,
  io = 6,
  timeout = 7,
  wrong_state = 8,
  device = 9,
  safety = 10,
  unsupported = 11,
  corrupt = 12,
  device_settings = 13,
  device_identity = 14,
  device_data = 15,
  device_motion = 16,
  device_refused = 17,
  device_restarted = 18,
  driver = 19,
  measurement = 20,
  trials_failed = 21,
  no_space = 22,
  busy = 23,
};

/// Name such as "device settings"; "unknown" for an undefined number.
std::string_view to_string(Errc code);

/// A row of docs/reference/errors.md.
struct ErrorCode {
  Errc code;
  std::string_view name;     ///< to_string()
  std::string_view kind;     ///< `error.data.kind` over the API
  int number;                ///< `error.code` over the API
  bool retryable;            ///< the same request may succeed later
  std::string_view meaning;  ///< one sentence
  std::string_view advice;   ///< what to do, one sentence
};
/// All codes, by number.
std::span<const ErrorCode> error_codes();

/// One failure: the parts of an error sentence. Initialise fields by name.
struct Error {
  class ByName {
   public:
    constexpr ByName() {}
  };
  [[no_unique_address]] ByName by_name = {};  ///< refuses initialisation by position
  Errc code = Errc::invalid_argument;
  std::string where = {};     ///< JSON pointer, file:line, device or stream; outermost first
  std::string what = {};      ///< the problem, one clause
  std::string expected = {};  ///< may be empty; also the next two
  std::string got = {};
  std::string hint = {};  ///< advice for the reader

  /// Prepends `context` to `where` ("trial.csv" + "line 7" gives "trial.csv: line 7").
  Error&& in(std::string_view context) &&;
};

/// "where: what: got (expected X). Hint." Empty parts leave no punctuation.
std::string to_string(const Error& error);

/// tl::expected that may not be ignored.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using tl::expected<T, Error>::expected;
  Result(tl::expected<T, Error>&& other) : tl::expected<T, Error>(std::move(other)) {}
};

using Status = Result<void>;

/// A failure: `return fail({.code = Errc::range, .where = "/speed", .what = "speed too high"})`.
inline tl::unexpected<Error> fail(Error error) {
  return tl::unexpected<Error>(std::move(error));
}

/// Passes an error to the caller and prepends `context` to its place.
inline tl::unexpected<Error> pass(Error error, std::string_view context = {}) {
  return tl::unexpected<Error>(context.empty() ? std::move(error) : std::move(error).in(context));
}

/// Prints the condition and its place, then aborts. For broken internal contracts; never reachable
/// from input.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace weft

#define WEFT_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::weft::assertion_failed(#condition, __FILE__, __LINE__))
