#!/bin/sh
# Makes echarts.min.js again from npm's packages, in a directory of its own: sh report/vendor/echarts/build.sh
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here/entry.mjs" "$work"
cd "$work"
npm init -y >/dev/null
npm install --no-audit --no-fund echarts@6.1.0 zrender@6.1.0 tslib@2.3.0 esbuild@0.28.2 >/dev/null
node node_modules/esbuild/install.js
npx esbuild entry.mjs --bundle --minify --format=iife --global-name=echarts --target=es2018 --legal-comments=none --outfile=built.js
# Pages are XML too: the script stands in a CDATA section, whose end must not occur in it; nor may the end of a script.
if grep -q -e '</script' -e ']]>' built.js; then
    sed -i 's/]]>/]] >/g' built.js
fi
if grep -q '</script' built.js; then
    echo "the library holds the end of a script" >&2
    exit 1
fi
{ echo '/* Apache ECharts 6.1.0 (Apache License 2.0) with zrender 6.1.0 (BSD 3-Clause); see LICENSE, LICENSE-zrender and NOTICE beside this file. */'; cat built.js; } >"$here/echarts.min.js"
