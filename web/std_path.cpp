// Debian's libc++ for WebAssembly declares std::filesystem::path, but was compiled without the
// members that take a path apart. These are they, with POSIX's rules, for what the module calls.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string_view>

#if defined(_LIBCPP_HAS_NO_FILESYSTEM)

_LIBCPP_BEGIN_NAMESPACE_FILESYSTEM

using View = std::string_view;

namespace {

constexpr char kSeparator = '/';

View parentOf(View whole) {
  const std::size_t end = whole.rfind(kSeparator);
  if (end == View::npos) return {};
  const std::size_t last = whole.find_last_not_of(kSeparator, end);
  return whole.substr(0, last == View::npos ? 1 : last + 1);
}

View nameOf(View whole) {
  const std::size_t end = whole.rfind(kSeparator);
  return end == View::npos ? whole : whole.substr(end + 1);
}

/// Returns where the extension of a name begins: at its end if it has none.
std::size_t dotOf(View name) {
  const std::size_t dot = name.rfind('.');
  return dot == View::npos || dot == 0 || name == ".." ? name.size() : dot;
}

/// Returns the part of a path that begins at `from`, where a separator before it is left out but
/// for the root: empty at the end.
View partFrom(View whole, std::size_t from) {
  std::size_t begin = from;
  if (from > 0 || !whole.starts_with(kSeparator))
    begin = std::min(whole.find_first_not_of(kSeparator, from), whole.size());
  else
    return whole.substr(0, 1);
  return whole.substr(begin, whole.find(kSeparator, begin) - begin);
}

}  // namespace

View path::__root_name() const {
  return {};
}
View path::__root_directory() const {
  return View(__pn_).substr(0, __pn_.starts_with(kSeparator) ? 1 : 0);
}
View path::__parent_path() const {
  return parentOf(__pn_);
}
View path::__filename() const {
  return nameOf(__pn_);
}
View path::__stem() const {
  const View name = nameOf(__pn_);
  return name.substr(0, dotOf(name));
}
View path::__extension() const {
  const View name = nameOf(__pn_);
  return name.substr(dotOf(name));
}

/// Compares part by part, by which a separator sorts before all else.
int path::__compare(View other) const {
  View one = __pn_;
  if (one.starts_with(kSeparator) != other.starts_with(kSeparator))
    return one.starts_with(kSeparator) ? 1 : -1;
  std::size_t at = 0;
  std::size_t otherAt = 0;
  for (;;) {
    const View part = partFrom(one, at);
    const View otherPart = partFrom(other, otherAt);
    if (part != otherPart || part.empty()) return part.compare(otherPart);
    at = static_cast<std::size_t>(part.data() - one.data()) + part.size();
    otherAt = static_cast<std::size_t>(otherPart.data() - other.data()) + otherPart.size();
  }
}

/// Goes through the parts; a separator at the end is none here.
path::iterator path::begin() const {
  iterator at;
  at.__path_ptr_ = this;
  at.__entry_ = partFrom(__pn_, 0);
  at.__stashed_elem_.__pn_ = at.__entry_;
  at.__state_ = at.__entry_.empty() ? iterator::_AtEnd : iterator::_InFilenames;
  return at;
}
path::iterator path::end() const {
  iterator at;
  at.__path_ptr_ = this;
  at.__entry_ = View(__pn_).substr(__pn_.size());
  at.__state_ = iterator::_AtEnd;
  return at;
}
path::iterator& path::iterator::__increment() {
  const View whole = __path_ptr_->native();
  const auto done = static_cast<std::size_t>(__entry_.data() - whole.data()) + __entry_.size();
  __entry_ = partFrom(whole, done);
  __stashed_elem_ = path(std::string(__entry_));
  if (__entry_.empty()) __state_ = _AtEnd;
  return *this;
}

_LIBCPP_END_NAMESPACE_FILESYSTEM

#endif
