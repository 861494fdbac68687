#!/bin/sh
# Makes three.min.js anew in a temporary folder, from the npm registry (wants node 20 or later): README.md here.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
there=$(mktemp -d)
trap 'rm -rf "$there"' EXIT
cd "$there"
npm init -y >/dev/null
npm install --ignore-scripts --no-audit --no-fund three@0.187.0 esbuild@0.28.2
cp "$here/three-parts.js" .
npx esbuild three-parts.js --bundle --minify --format=iife --global-name=MillThree --target=es2020 \
    --charset=ascii --legal-comments=none --outfile="$here/three.min.js" \
    --banner:js="/*! three.js 0.187.0 with OrbitControls
$(cat node_modules/three/LICENSE)*/"
cp node_modules/three/LICENSE "$here/three-LICENSE.txt"
