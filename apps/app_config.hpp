// The configuration of a run, as files and the command line know it.
#pragma once

namespace covsplat {

/// Every module that can be configured has its section here.
struct AppConfig {
  template <class Self, class V>
  static void Visit(Self& /*c*/, V&& /*v*/) {}
};

}  // namespace covsplat
