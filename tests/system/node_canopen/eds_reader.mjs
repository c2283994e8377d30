#!/usr/bin/env node
// What a reader of data sheets that was not written here, that of the npm package `canopen`, finds in one.
// usage: node eds_reader.mjs FILE        prints a JSON document, or ends with the package's complaint
//
// {"device": {...}, "objects": [{"index", "subindex", "name", "type", "access", "mappable", "default", "value"}]};
// "default" is the text in the file, if there is one, "value" what the package makes of it.

import { DataType, Eds } from './canopen_package.mjs';

if (process.argv.length !== 3) {
  console.error('usage: node eds_reader.mjs FILE');
  process.exit(2);
}
const eds = Eds.fromFile(process.argv[2]);
const types = Object.fromEntries(Object.entries(DataType).map(([name, type]) => [type, name]));

const objects = [];
for (const entry of eds.values()) {
  const highest = entry.subNumber ? entry.at(0).value : 0;
  for (let subindex = 0; subindex <= highest; ++subindex) {
    const object = entry.subNumber ? entry.at(subindex) : entry;
    if (!object) continue; // a gap in a record
    const { parameterName: name, accessType: access, pdoMapping, defaultValue } = object;
    // The package has the highest sub-index in the place of a count that is a setting.
    const value = entry.subNumber && subindex === 0 ? Number(defaultValue) : object.value;
    objects.push({ index: entry.index, subindex, name, type: types[object.dataType], access,
                   mappable: pdoMapping === '1', default: defaultValue, value });
  }
}
const { productName, revisionNumber, baudRates, nrOfRXPDO, nrOfTXPDO, lssSupported, dummyUsage } = eds;
const device = { productName, revisionNumber, baudRates, nrOfRXPDO, nrOfTXPDO, lssSupported, dummyUsage };
console.log(JSON.stringify({ device, objects }));
