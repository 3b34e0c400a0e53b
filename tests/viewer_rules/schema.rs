//! The subset of JSON Schema that viewers read, and whether a message fits it.

use serde_json::Value;

/// An error where a viewer would not read the schema: it then loses the channel.
pub(super) fn check_subset(schema: &Value, at: &str) -> Result<(), String> {
    if schema["type"] != "object" {
        return Err(format!("{at}: type {}, expected \"object\"", schema["type"]));
    }
    for (key, field) in schema["properties"].as_object().into_iter().flatten() {
        let at = format!("{at}.{key}");
        match field["oneOf"].as_array() {
            Some(options) if options.iter().all(|option| option["const"].is_number()) => {}
            Some(_) => return Err(format!("{at}: oneOf of other than numbers")),
            None => check_type(field, &at, false)?,
        }
    }
    Ok(())
}

fn check_type(schema: &Value, at: &str, is_item: bool) -> Result<(), String> {
    match schema["type"].as_str() {
        Some("boolean" | "number" | "integer") => Ok(()),
        Some("string") => match &schema["contentEncoding"] {
            Value::Null => Ok(()),
            encoding if *encoding == "base64" && !is_item => Ok(()),
            encoding => Err(format!("{at}: contentEncoding {encoding}")),
        },
        Some("object") => check_subset(schema, at),
        Some("array") if is_item => Err(format!("{at}: nested arrays")),
        Some("array") if schema["items"].is_object() => {
            check_type(&schema["items"], &format!("{at}[]"), true)
        }
        Some("array") => Err(format!("{at}: an array without one schema of its items")),
        _ if schema["$ref"].is_string() => Err(format!("{at}: $ref")),
        _ => Err(format!("{at}: type {}", schema["type"])),
    }
}

/// An error where a message is not as its schema says, or has what the schema doesn't name.
pub(super) fn fits(value: &Value, schema: &Value, at: &str) -> Result<(), String> {
    if let Some(options) = schema["oneOf"].as_array() {
        let known = options.iter().any(|option| option["const"] == *value);
        return if known { Ok(()) } else { Err(format!("{at}: {value} is none of the enum's numbers")) };
    }
    let kind = schema["type"].as_str().unwrap_or_default();
    let right = match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        _ => value.is_number(),
    };
    if !right {
        return Err(format!("{at}: {value} is no {kind}"));
    }
    if let Some(number) = value.as_f64() {
        let beyond =
            |key: &str, sign: f64| schema[key].as_f64().is_some_and(|end| (number - end) * sign > 0.0);
        if beyond("minimum", -1.0) || beyond("maximum", 1.0) {
            return Err(format!("{at}: {number} is out of range"));
        }
    }
    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
        fits(item, &schema["items"], &format!("{at}[{i}]"))?;
    }
    let Some(object) = value.as_object() else { return Ok(()) };
    for required in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        if !object.contains_key(required) {
            return Err(format!("{at}.{required} is missing"));
        }
    }
    for (key, field) in object {
        let known = schema["properties"].get(key);
        fits(
            field,
            known.ok_or_else(|| format!("{at}.{key} is not in the schema"))?,
            &format!("{at}.{key}"),
        )?;
    }
    Ok(())
}
