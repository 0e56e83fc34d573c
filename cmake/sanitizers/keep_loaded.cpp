// Under AddressSanitizer, libraries stay loaded after dlclose: a leak reported from a driver that has been unloaded has
// no names left that the suppressions could match.
#if defined(__SANITIZE_ADDRESS__)
#define GLINT_KEEP_LOADED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define GLINT_KEEP_LOADED 1
#endif
#endif

#ifdef GLINT_KEEP_LOADED
extern "C" int dlclose(void*) noexcept { return 0; }
#endif
