#!/bin/sh
# Runs a test program, which then prints the time of each test. Documentation tests and others know no such option.
case "$1" in
*/deps/*) RUSTC_BOOTSTRAP=1 exec "$@" -Z unstable-options --report-time ;;
*) exec "$@" ;;
esac
